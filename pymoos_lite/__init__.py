"""A community publish/subscribe middleware for marine robots: database, link, apps, hosts and tools."""

from pymoos_lite.compiled import install

# Before any other module of ours is imported, else its plain form is.
install()
