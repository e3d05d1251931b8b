"""The commands of mtm-onboard, one a module, each with `add_parser(subparsers)`."""
