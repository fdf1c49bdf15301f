"""An aerial-aquatic manipulator: quadrotor, arm of three joints, three-finger gripper."""
