"""The behaviours that come with pymoos-lite, one file each."""
