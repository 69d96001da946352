"""Mission files, macros, declared parameters and the registry of apps."""
