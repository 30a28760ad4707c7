# haptic-ctl completes itself, with the parameters and scenes of the running daemon.
haptic-ctl completions fish | source
