from .scene import (
    Dots as Dots,
    Layer as Layer,
    Scene as Scene,
    Strokes as Strokes,
    Tags as Tags,
    cell_scene as cell_scene,
    packed as packed,
    packed_places as packed_places,
    scene_data as scene_data,
)
