"""The behaviours that come with pymoos-lite, one file each."""

from pymoos_lite.compiled import install

# Before any other module of ours is imported, else its plain form is.
install()
