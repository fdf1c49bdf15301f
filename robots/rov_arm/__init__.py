"""A vehicle of the BlueROV2 Heavy kind with an arm of four joints and a three-finger gripper."""
