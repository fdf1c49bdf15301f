"""A hexacopter with an arm of four joints and a three-finger gripper, for air and water."""
