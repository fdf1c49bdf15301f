"""Two recordings of one quadrotor, as its autopilot and a ROS 2 recorder wrote them."""
