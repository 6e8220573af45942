"""Find the motion by the contrast of images of warped events: for a whole recording, or causally window by window."""
