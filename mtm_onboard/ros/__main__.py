"""`python3 -m mtm_onboard.ros --ros-args -p key:=robot.key ...`."""

import sys

from mtm_onboard.ros.node import main

if __name__ == "__main__":
    sys.exit(main())
