# haptic-ctl completes itself, with the parameters and scenes of the running daemon.
eval "$(haptic-ctl completions bash)"
