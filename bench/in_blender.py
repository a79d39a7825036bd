"""Renders a scene by Cycles: run by an interpreter that has `bpy`, see `bench.beside_cycles`.

    python -I in_blender.py SCENE.json SPP SEED GUIDING OUT.exr

SCENE.json: width, height, depth, fov [degrees], camera (4 rows of 4), and shapes: files of meshes
(`vertices`, `faces` in .npz), each with a kind of surface and its numbers. A single thread; box
filter.
"""

import json
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix


def main(file, spp, seed, guiding, out):
    """Render a file to a picture."""
    described = json.loads(Path(file).read_text())
    scene = bpy.context.scene
    scene.world = None
    for item in list(bpy.data.objects):  # of the scene that Blender begins with
        bpy.data.objects.remove(item)
    for number, shape in enumerate(described["shapes"]):
        arrays = np.load(shape["file"])
        mesh = bpy.data.meshes.new(f"{number}")
        mesh.from_pydata(arrays["vertices"].tolist(), [], arrays["faces"].tolist())
        mesh.materials.append(surface(f"{number}", shape))
        scene.collection.objects.link(bpy.data.objects.new(f"{number}", mesh))
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.angle = "HORIZONTAL", np.radians(described["fov"])
    lens.clip_start, lens.clip_end = 1e-4, 1e5
    camera = bpy.data.objects.new("camera", lens)
    camera.matrix_world = Matrix(described["camera"])
    scene.collection.objects.link(camera)
    scene.camera = camera
    film(scene.render, described["width"], described["height"], out)
    settle(scene.cycles, described["depth"], int(spp), int(seed), guiding == "1")
    bpy.ops.render.render(write_still=True)


def surface(name, shape):
    """Return a material with a single node; a lamp emits from its front."""
    shader = bpy.data.materials.new(name)
    shader.use_nodes = True
    nodes, link = shader.node_tree.nodes, shader.node_tree.links.new
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    kind = {"Lamp": "Emission", "Glass": "BsdfGlass", "Diffuse": "BsdfDiffuse"}[shape["kind"]]
    node = nodes.new(f"ShaderNode{kind}")
    link(node.outputs[0], out.inputs["Surface"])
    if shape["kind"] == "Diffuse":
        node.inputs["Color"].default_value = (*shape["colour"], 1.0)
        node.inputs["Roughness"].default_value = 0.0
    elif shape["kind"] == "Glass":
        node.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        node.inputs["Roughness"].default_value = 0.0
        node.inputs["IOR"].default_value = shape["index"]
    else:
        front = nodes.new("ShaderNodeMath")
        front.operation, front.inputs[0].default_value = "SUBTRACT", 1.0
        times = nodes.new("ShaderNodeMath")
        times.operation, times.inputs[0].default_value = "MULTIPLY", shape["radiance"]
        link(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs[1])
        link(front.outputs[0], times.inputs[1])
        link(times.outputs[0], node.inputs["Strength"])
        shader.cycles.emission_sampling = "FRONT"
    return shader


def film(render, width, height, out):
    """Set a linear picture in single precision, rendered by a thread."""
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, height, 100
    render.filepath = out
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.threads_mode, render.threads = "FIXED", 1
    render.use_persistent_data = False


def settle(cycles, depth, spp, seed, guiding):
    """Settings without bias: nothing is clamped, blurred, denoised or left out."""
    cycles.device, cycles.samples, cycles.seed = "CPU", spp, seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    for kind in ("max", "diffuse", "glossy", "transmission", "transparent_max"):
        setattr(cycles, f"{kind}_bounces", depth - 2)  # none is light straight from a lamp
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy, cycles.light_sampling_threshold = 0.0, 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.use_guiding = guiding


if __name__ == "__main__":
    main(*sys.argv[1:])
