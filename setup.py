"""Map the repository's top-level folders into the one import package ``seals``."""

from setuptools import find_packages, setup

ROOTS = {"seals": "seals"} | {
    f"seals.{folder}": folder for folder in ("plugins", "conf", "robots", "animals", "experiments")
}
setup(
    package_dir=ROOTS,
    packages=[
        name
        for package, folder in ROOTS.items()
        for name in (package, *(f"{package}.{sub}" for sub in find_packages(folder)))
    ],
)
