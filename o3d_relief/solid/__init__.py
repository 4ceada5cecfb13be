"""What goes out to be made: closed bodies in millimetres."""
