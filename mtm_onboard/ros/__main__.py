"""`python3 -m mtm_onboard.ros --ros-args -p key:=robot.key ...`."""

import sys

from mtm_onboard.loading import interruptible_loading

if __name__ == "__main__":
    with interruptible_loading("mtm"):
        from mtm_onboard.ros.node import main
    sys.exit(main())
