"""A remotely operated vehicle of 13.5 kg with eight thrusters, of the BlueROV2 Heavy kind."""
