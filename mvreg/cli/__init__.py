"""The command line: `mvreg`, its subcommands and its exit codes."""
