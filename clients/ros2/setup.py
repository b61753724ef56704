"""The package of the node, for colcon and for pip."""

from setuptools import setup

setup(
    name="retina_ros2",
    version="0.1.0",
    packages=["retina_ros2"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/retina_ros2"]),
        ("share/retina_ros2", ["package.xml"]),
    ],
    install_requires=["setuptools", "retina-client"],
    zip_safe=True,
    description="The retina under a needle: pose and wrench in, deformed surface out.",
    license="MIT OR Apache-2.0",
    entry_points={"console_scripts": ["retina = retina_ros2.node:main"]},
)
