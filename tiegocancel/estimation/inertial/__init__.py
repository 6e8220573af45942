"""Read gyroscopes, find their bias and clock, and fuse them with what the events say."""
