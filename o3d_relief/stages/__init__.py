"""The stages of the method, a module per section of the paper, arrays in and new arrays out."""
