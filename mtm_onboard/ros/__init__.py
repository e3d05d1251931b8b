"""A ROS 2 node between a controller's `cmd_vel` and the robot: the same commands, with the message in them."""
