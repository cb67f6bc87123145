"""Down-sample scans."""
