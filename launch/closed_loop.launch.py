"""Start a body in MuJoCo and the muscle node that moves it, in lockstep or in real time.

ros2 launch xb_muscle_ros closed_loop.launch.py scene:=ankle mode:=realtime elastic_tendon:=true namespace:=left_leg
ros2 launch xb_muscle_ros closed_loop.launch.py scene:=myolegs duration_s:=3.0

Ends with the body, which plays `episodes` (0: until stopped); with `respawn:=true` both are started again instead.
Without `ros2 launch`: see docs/loop.md.
"""

from launch.actions import OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration

from launch import LaunchDescription
from xb_muscle_ros.node.launching import argument, common_arguments, node, values
from xb_muscle_ros.plant.scene_fibres import SCENES, scene_fibres

OF_BOTH = {"fiber_file": str, "mode": str}
OF_THE_MUSCLES = {"autostart": bool, "state_file": str, "load_state_at_start": bool}
OF_THE_BODY = {"scene": str, "elastic_tendon": bool, "duration_s": float, "episodes": int, "give_up_s": float}


def generate_launch_description() -> LaunchDescription:
    """Return the launch arguments, the muscles and the body that they move."""
    arguments = [
        argument("fiber_file", "18Dec2017a", "fibre file, a path or the name of a packaged fibre"),
        argument(
            "model", "", "parameter set of the fibre file; empty: 3state_coop, in the scene myolegs 3state_coop_slack"
        ),
        argument(
            "mode",
            "lockstep",
            "realtime: both by their own clocks; lockstep: in turn, the same bits each time",
            ["realtime", "lockstep"],
        ),
        argument("scene", "ankle", "what to move; myolegs: two legs with eighty muscles", SCENES),
        argument("elastic_tendon", "false", "tendons stretch"),
        argument("duration_s", "1.0", "length of an episode in s"),
        argument("episodes", "0", "how many; 0: until stopped"),
        argument("give_up_s", "0.0", "longest wait of the body for its muscles in s; 0: without end"),
        argument("state_file", "", "file of the muscles' ~/save_state and ~/load_state"),
        argument("load_state_at_start", "false", "the muscles go on with the states in state_file"),
        argument("namespace", "", "namespace of both nodes and their topics"),
        *common_arguments(),
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=_nodes)])


def _nodes(context):
    scene, model = (LaunchConfiguration(name).perform(context) for name in ("scene", "model"))
    # Constants and parameters of the fibres come from the body.
    fibres = scene_fibres(scene, model)
    muscles = {**values({**OF_BOTH, **OF_THE_MUSCLES}), "fibers": list(fibres.names), "model": fibres.model}
    body = {**values({**OF_BOTH, **OF_THE_BODY}), "model": fibres.body_model}
    where = {"namespace": LaunchConfiguration("namespace")}
    again = LaunchConfiguration("respawn").perform(context).lower() in ("true", "1")
    end = {} if again else {"on_exit": Shutdown()}
    return [
        node(context, "muscle_node", muscles, **where),
        node(context, "plant_node", body, **where, **end),
    ]
