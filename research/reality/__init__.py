"""Study of the emulator beside logs of real robots."""
