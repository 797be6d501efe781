"""Teams of emulated robots in one process: lockstep, radio, contacts and figures."""
