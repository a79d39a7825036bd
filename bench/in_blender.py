"""Renders a scene by Cycles: run by an interpreter that has `bpy`, see `bench.beside_cycles`.

    python -I in_blender.py SCENE.json SPP SEED OUT.exr [guiding]

SCENE.json: size, depth, fov [degrees], camera (4 rows of 4), and shapes: files of meshes
(`vertices`, `faces`, and `normals` and `uvs` if any, in .npz), each with a kind of shader and its
inputs. A single thread; box filter.
"""

import json
import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix


def main(file, spp, seed, out, *guiding):
    """Render a file to a picture."""
    described = json.loads(Path(file).read_text())
    scene = bpy.context.scene
    scene.world = None
    for item in list(bpy.data.objects):  # of the scene that Blender begins with
        bpy.data.objects.remove(item)
    for number, shape in enumerate(described["shapes"]):
        arrays = np.load(shape["file"])
        mesh = bpy.data.meshes.new(f"{number}")
        lists = (arrays["vertices"].tolist(), [], arrays["faces"].tolist())
        mesh.from_pydata(*lists, shade_flat="normals" not in arrays)
        if "normals" in arrays:
            mesh.normals_split_custom_set_from_vertices(arrays["normals"].tolist())
        if "uvs" in arrays:
            corners = arrays["uvs"][arrays["faces"].ravel()].ravel()
            mesh.uv_layers.new().data.foreach_set("uv", corners)
        mesh.materials.append(surface(f"{number}", shape))
        scene.collection.objects.link(bpy.data.objects.new(f"{number}", mesh))
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.angle = "HORIZONTAL", np.radians(described["fov"])
    lens.clip_start, lens.clip_end = 1e-4, 1e5
    camera = bpy.data.objects.new("camera", lens)
    camera.matrix_world = Matrix(described["camera"])
    scene.collection.objects.link(camera)
    scene.camera = camera
    film(scene.render, *described["size"], out)
    settle(scene.cycles, described["depth"], int(spp), int(seed), guiding == ("guiding",))
    bpy.ops.render.render(write_still=True)


def surface(name, shape):
    """Return a material with a shader, which absorbs inside or emits from its front."""
    shader = bpy.data.materials.new(name)
    shader.use_nodes = True
    nodes, link = shader.node_tree.nodes, shader.node_tree.links.new
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    node = nodes.new(f"ShaderNode{shape['kind']}")
    last = node.outputs[0]
    if shape["kind"] == "BsdfMetallic":  # its indices leave no place for a factor
        node.fresnel_type = "PHYSICAL_CONDUCTOR"
        mix = nodes.new("ShaderNodeMixShader")
        black = nodes.new("ShaderNodeBsdfDiffuse")
        black.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
        link(black.outputs[0], mix.inputs[1])
        link(last, mix.inputs[2])
        tint, last = mix.inputs[0], mix.outputs[0]
    else:
        tint = node.inputs["Base Color" if shape["kind"] == "BsdfPrincipled" else "Color"]
    if hasattr(node, "distribution"):  # without light between facets, as in clpt
        node.distribution = shape.get("distribution", "GGX")
    for key in {"Roughness", "IOR", "Extinction", "Metallic"} & set(shape):
        node.inputs[key].default_value = shape[key]
    if "image" in shape:
        texture = nodes.new("ShaderNodeTexImage")
        texture.image = bpy.data.images.load(shape["image"])
        texture.image.colorspace_settings.name = "Non-Color"
        texture.interpolation = "Closest" if shape["closest"] else "Linear"
        link(texture.outputs["Color"], tint)
    elif "Color" in shape:
        numbers = shape["Color"]
        tint.default_value = sum(numbers) / 3 if tint.type == "VALUE" else (*numbers, 1.0)
    if "absorbs" in shape:
        density = max(shape["absorbs"])
        volume = nodes.new("ShaderNodeVolumeAbsorption")
        volume.inputs["Density"].default_value = density
        volume.inputs["Color"].default_value = (*(1 - a / density for a in shape["absorbs"]), 1.0)
        link(volume.outputs[0], out.inputs["Volume"])
    if shape["kind"] == "Emission":
        front = nodes.new("ShaderNodeMath")
        front.operation, front.inputs[0].default_value = "SUBTRACT", 1.0
        link(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs[1])
        link(front.outputs[0], node.inputs["Strength"])
        shader.cycles.emission_sampling = "FRONT"
    link(last, out.inputs["Surface"])
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
    cycles.use_light_tree, cycles.use_guiding = True, guiding


if __name__ == "__main__":
    main(*sys.argv[1:])
