"""Draw the thesis's figures anew, each with its controls in the same axes, and one page around them."""
