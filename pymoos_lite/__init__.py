"""A community publish/subscribe middleware for marine robots: database, link, apps, hosts and tools."""
