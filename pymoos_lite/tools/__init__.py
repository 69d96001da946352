"""What a person runs: the command line, scope, poke, log tools, mission check."""
