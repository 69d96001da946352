"""Share (bridge), node and shore broker, node comms, message handler."""
