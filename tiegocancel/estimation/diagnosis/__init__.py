"""Tell what is wrong with a motion by where events lie beside their predictions, and correct it."""
