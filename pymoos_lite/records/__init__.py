"""One module per message format: parsed and printed in exactly one place."""
