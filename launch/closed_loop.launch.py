"""Start a body in MuJoCo and the muscle node that moves it, in lockstep or in real time.

ros2 launch xb_muscle_ros closed_loop.launch.py scene:=ankle mode:=realtime elastic_tendon:=true namespace:=left_leg

Ends with the body, which plays `episodes` (0: until stopped). Without `ros2 launch`: see docs/loop.md.
"""

from launch.actions import DeclareLaunchArgument, Shutdown
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from launch import LaunchDescription

# The muscles of each scene, which are the fibres of the node.
MUSCLES = {"ankle": ["soleus", "tibialis_anterior"], "knee": ["vasti"]}

# Without a type a name like 1 would arrive as an integer and be refused.
OF_BOTH = {"fiber_file": str, "model": str, "mode": str}
OF_THE_BODY = {"scene": str, "elastic_tendon": bool, "duration_s": float, "episodes": int}


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments, the muscles and the body that they move."""
    arguments = [
        DeclareLaunchArgument(
            "fiber_file", default_value="18Dec2017a", description="fibre file, a path or the name of a packaged fibre"
        ),
        DeclareLaunchArgument("model", default_value="3state_coop", description="parameter set of the fibre file"),
        DeclareLaunchArgument(
            "mode",
            default_value="lockstep",
            choices=["realtime", "lockstep"],
            description="realtime: both by their own clocks; lockstep: in turn, the same bits each time",
        ),
        DeclareLaunchArgument("scene", default_value="ankle", choices=[*MUSCLES], description="what to move"),
        DeclareLaunchArgument("elastic_tendon", default_value="false", description="tendons stretch"),
        DeclareLaunchArgument("duration_s", default_value="1.0", description="length of an episode in s"),
        DeclareLaunchArgument("episodes", default_value="0", description="how many; 0: until stopped"),
        DeclareLaunchArgument("namespace", default_value="", description="namespace of both nodes and their topics"),
    ]
    fibers = PythonExpression([f"{MUSCLES!r}['", LaunchConfiguration("scene"), "']"])
    muscles = Node(
        package="xb_muscle_ros",
        executable="muscle_node",
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        parameters=[{"fibers": ParameterValue(fibers, value_type=list[str]), **_given(OF_BOTH)}],
    )
    body = Node(
        package="xb_muscle_ros",
        executable="plant_node",
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        parameters=[_given({**OF_BOTH, **OF_THE_BODY})],
        on_exit=Shutdown(),
    )
    return LaunchDescription([*arguments, muscles, body])


def _given(kinds: dict[str, type]) -> dict[str, ParameterValue]:
    return {name: ParameterValue(LaunchConfiguration(name), value_type=kind) for name, kind in kinds.items()}
