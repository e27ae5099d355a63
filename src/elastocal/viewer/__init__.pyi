from .scene import (
    Dots as Dots,
    Layer as Layer,
    Scene as Scene,
    Strokes as Strokes,
    Tags as Tags,
    arms_scene as arms_scene,
    cell_scene as cell_scene,
    packed as packed,
    packed_places as packed_places,
    robot_solids as robot_solids,
    scene_data as scene_data,
)
