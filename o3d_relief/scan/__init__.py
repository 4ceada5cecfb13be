"""From points to a surface: what a scan goes through before it is a scene."""
