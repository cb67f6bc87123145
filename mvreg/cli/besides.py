"""What ``mvreg plugins`` says of plugins beside their stages: formats in and out, observers."""

from __future__ import annotations

from mvreg.export import table
from mvreg.export.brought import Guarded as Writer
from mvreg.plugins import manager
from mvreg.plugins.formats import Guarded as Reader
from mvreg.plugins.pluggy_manager import HERE


def besides() -> list[str]:
    """Lines that say what plugins bring beside stages, none where they bring nothing."""
    found = [
        f"  files ending in {suffix}: {each.name}  [{each.read.who}]"
        for suffix, each in manager.formats().items() if isinstance(each.read, Reader)
    ]  # fmt: skip
    found += [
        f"  export={name}: {each.summary}  [{each.write.who}]"
        for name, each in table.formats().items() if isinstance(each.write, Writer)
    ]  # fmt: skip
    in_use = manager.current()
    for hook in in_use.hook.mvreg_event.get_hookimpls():
        origin = in_use.origin_of(hook.plugin_name)
        if origin != HERE and hook.plugin_name != "mvreg":
            found.append(f"  an observer of runs  [plugin {hook.plugin_name!r} ({origin})]")
    return ["besides, from plugins:", *found, ""] if found else []
