"""Commands of `odeform` in a clone, by the entry points `odeform.commands`."""
