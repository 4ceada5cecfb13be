"""What is looked at: pictures without a display."""
