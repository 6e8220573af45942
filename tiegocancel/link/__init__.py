"""Talk to event cameras and devices over serial links: transports, protocols, flow, recording and replay."""
