"""Beyond the paper: what is guaranteed."""
