complete --keep-order --exclusive --command haptic-ctl --arguments "(COMPLETE=fish haptic-ctl -- (commandline --current-process --tokenize --cut-at-cursor) (commandline --current-token))"
