"""The computer a case runs on: clock, signals, memory, versions of what is installed."""
