"""The directives of a PBRT file: what each changes or defines."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clpt import transforms
from clpt.errors import SceneError, UnknownKindError, did_you_mean
from clpt.files import input_files
from clpt.formats.pbrt import old_words
from clpt.formats.pbrt.params import UPGRADE, Parameter, Parameters
from clpt.formats.pbrt.state import TARGETS, Contents, Definition, State, TransformDirectives

COLOUR_SPACES = ("srgb", "rec2020", "aces2065-1", "dci-p3")
OPTIONS = ("Camera", "Film", "PixelFilter", "Sampler", "Integrator", "Accelerator")
OLD = ("WorldEnd", "SurfaceIntegrator", "VolumeIntegrator", "Renderer", "Volume", "PixelSampler")
HARMLESS = ("rendercoordsys", "msereferenceimage", "msereferenceout", "pixelstats", "wavefront")


def read(path: Path) -> Contents:
    """Read a file and all that it includes. Raises SceneError with file and line."""
    return _Reader(path).run()


class _Reader(TransformDirectives):
    """All directives but those of transforms."""

    def __init__(self, path: Path):
        super().__init__(path)
        self.stack: list[
            tuple[str, State, str]
        ] = []  # the scope that began, the state before it, and its location
        self.in_world = False
        self.object: list[Definition] | None = None
        self.keys: dict[str, str] = {}  # of objects that are defined again

    def run(self) -> Contents:
        self.go_through(self.path)
        if self.stack:
            label, _, location = self.stack[-1]
            raise SceneError(f"the {label}Begin at {location} has no end", file=self.path)
        if not self.in_world:
            raise SceneError("has no WorldBegin, so it holds no scene", file=self.path)
        return self.contents

    def directive(self) -> None:
        """Take the next directive and do what it says."""
        self.name = input_files.decode(self.lexer.next("a directive"))
        if self.contents.shared.old and not self._modernise():
            return
        action = DIRECTIVES.get(self.name)
        if action is None:
            raise self._unknown()
        with self.locating():
            action(self)

    def _modernise(self) -> bool:
        """Take a directive of version 2 or 3 for that of version 4, if there is such."""
        today = old_words.directive(self.name)
        if not today:
            with self.locating():
                self._definition(f'{self.name} "{{}}"')
            self.warn_once("is left out")
            return False
        self.name = today
        return True

    def _unknown(self) -> SceneError:
        name = self.name
        if name in OLD:
            return self.lexer.error(f"{name} is {UPGRADE}")
        if name[:1] in '"[]' or not name.isalpha():
            return self.lexer.error(f"expected a directive, found {name[:40]!r}")
        return self.lexer.error(f"unknown directive {name[:40]!r}{did_you_mean(name, DIRECTIVES)}")

    # Before and after WorldBegin

    def only(self, in_world: bool) -> None:
        """Refuse a directive that belongs to the other part of the file."""
        if self.in_world != in_world:
            must = "come after" if in_world else "stand before"
            raise SceneError(f"must {must} WorldBegin")

    def world_begin(self) -> None:
        self.only(False)
        self.in_world, self.state.active = True, (True, True)
        self.state.ctm, self.state.end = np.eye(4), None
        self.contents.shared.systems["world"] = np.eye(4), None

    def world_end(self) -> None:
        """Versions 2 and 3 end a scene so; another picture may follow."""
        if not self.contents.shared.old:
            raise self._unknown()
        if self.lexer.peek():
            self.warn("the pictures behind it are left out: the first is read")
        self.lexer.skip()

    def option(self) -> None:
        """Camera, Film and the like; versions 2 and 3 ignore them after WorldBegin."""
        ignored = self.contents.shared.old and self.in_world
        self.only(ignored)
        name = self.name
        definition = self._definition(f'{name} "{{}}"')
        if ignored:
            self.warn("stands after WorldBegin and is left out")
            return
        self.contents.options[name] = definition
        if name == "Camera":
            ctm, end = self.state.ctm, self.state.end
            if transforms.is_singular(ctm) or (end is not None and transforms.is_singular(end)):
                raise SceneError("the camera's transform cannot be inverted")
            last = None if end is None else transforms.inverse(end)
            self.contents.shared.systems["camera"] = transforms.inverse(ctm), last

    def set_option(self) -> None:
        name = self.lexer.string("an option").split()[-1:]
        normal = "".join(name).lower().replace("_", "").replace("-", "")
        value = self.lexer.next("an option's value")
        if normal == "seed":
            try:
                self.contents.seed = int(value) % 2**31
            except ValueError:
                raise SceneError("the seed must be a whole number") from None
        elif normal not in HARMLESS and value != b"false":
            self.warn(f"the option {''.join(name)!r} is left out")

    # Scopes

    def attribute_begin(self) -> None:
        self._begin("Attribute")

    def attribute_end(self) -> None:
        self._end("Attribute")

    def transform_begin(self) -> None:
        """As an AttributeBegin in version 4; in older versions it keeps only transforms."""
        self._begin("Transform" if self.contents.shared.old else "Attribute")

    def transform_end(self) -> None:
        self._end("Transform" if self.contents.shared.old else "Attribute")

    def _begin(self, label: str) -> None:
        self.only(True)
        location = f"{self.lexer.path.name}:{self.lexer.line}"
        self.state.number = self.contents.shared.count
        self.stack.append((label, self.state, location))
        self.state = self.state.copy()

    def _end(self, label: str) -> None:
        if not self.stack:
            raise SceneError(f"no {label}Begin stands before it")
        began, state, location = self.stack.pop()
        if began != label:
            raise SceneError(f"the {began}Begin at {location} must end first")
        state.file_folder = self.state.file_folder
        if label != "Transform" and self.contents.shared.old:
            self.contents.shared.end_scope(state.number)
        if label == "Transform":
            kept = self.state.copy()
            kept.ctm, kept.end, kept.active = state.ctm, state.end, state.active
            state = kept
        self.state = state

    def object_begin(self) -> None:
        name = self.lexer.string("a name")
        if self.object is not None:
            raise SceneError("objects cannot stand in objects")
        if name in self.contents.objects:
            if not self.contents.shared.old:
                raise SceneError(f"the object {name!r} is already defined")
            self.warn(f"the object {name!r} is defined again: it counts from here")
            self.keys[name] = f"{name} (line {self.lexer.line})"
        self._begin("Object")
        self.object = self.contents.objects[self.keys.get(name, name)] = []

    def object_end(self) -> None:
        self._end("Object")
        self.object = None

    def object_instance(self) -> None:
        self.only(True)
        if self.object is not None:
            raise SceneError("cannot stand in an object")
        name = self.lexer.string("a name")
        params = Parameters(f'ObjectInstance "{name}"', self.lexer.path, self.lexer.line)
        name = self.keys.get(name, name)
        self.contents.uses.append(Definition(name, params, self.state.copy()))

    def include(self) -> None:
        self.go_through(self._named_file(), self.lexer)

    def import_file(self) -> None:
        """As an Include, but the state is as before at its end."""
        self.only(True)
        path, before, open_scopes = self._named_file(), self.state, len(self.stack)
        self.state = before.copy()
        self.go_through(path)
        if len(self.stack) != open_scopes:
            raise SceneError(f"{path.name} opens or closes scopes of the file that imports it")
        self.state = before

    def _named_file(self) -> Path:
        name = self.lexer.string("a file name")
        return self.state.existing_file(name)

    def reverse_orientation(self) -> None:
        self.state.reverse = not self.state.reverse

    # Definitions

    def _definition(self, label: str, target: str = "", words: str = "a type") -> Definition:
        kind, line = self.lexer.string(words), self.lexer.line
        label = label.replace("{}", kind)
        values = self.lexer.parameters(label)
        if len({parameter.name for parameter in values}) < len(values):
            values = self._last(values)
        shared = self.contents.shared
        if shared.old:
            with self.locating():
                kind, values = old_words.definition(self.name, kind, values)
        defaults = self.state.defaults.get(target, ())
        params = Parameters(label, self.lexer.path, line, values, defaults)
        shared.count += 1
        self.state.number = shared.count
        state = self.state.copy()
        for parameter in values:
            if parameter.name == "filename" and parameter.is_text:
                self.contents.shared.files.update(dict.fromkeys(parameter.texts(), state))
        return Definition(kind, params, state)

    def _last(self, values: list[Parameter]) -> list[Parameter]:
        """Return the last of parameters of a name, as pbrt does (src/pbrt/paramdict.cpp)."""
        last: dict[str, Parameter] = {}
        for parameter in values:
            if parameter.name in last:
                self.warn(f"{parameter.name!r} is given twice: the later value counts")
            last[parameter.name] = parameter
        return list(last.values())

    def attribute(self) -> None:
        definition = self._definition('Attribute "{}"')
        if definition.kind not in TARGETS:
            raise UnknownKindError("target", definition.kind, TARGETS)
        before = self.state.defaults.get(definition.kind, ())
        added = {definition.kind: (*before, *definition.params.given)}
        self.state.defaults = self.state.defaults | added

    def colour_space(self) -> None:
        name = self.lexer.string("a colour space")
        if name not in COLOUR_SPACES:
            raise UnknownKindError("colour space", name, COLOUR_SPACES)
        self.state.colour_space = name

    def shape(self) -> None:
        self.only(True)
        shapes = self.contents.shapes if self.object is None else self.object
        definition = self._definition('Shape "{}"', "shape")
        if self.object is not None and definition.state.motion() is not None:
            self.warn_once("a shape of an object stays where it is at the first time")
            definition.state.end = None
        if self.object is not None and definition.state.area_light is not None:
            self.warn_once(
                "shapes of an object emit no light in pbrt: its AreaLightSource is ignored"
            )
            definition.state.area_light = None
        shapes.append(definition)

    def light_source(self) -> None:
        self.only(True)
        self.contents.lights.append(self._definition('LightSource "{}"', "light"))

    def area_light_source(self) -> None:
        self.only(True)
        self.state.area_light = self._definition('AreaLightSource "{}"', "light")

    def material(self) -> None:
        self.only(True)
        self.state.material = self._definition('Material "{}"', "material")

    def make_named_material(self) -> None:
        self.only(True)
        definition = self._definition('MakeNamedMaterial "{}"', "material", "a name")
        name, shared = definition.kind, self.contents.shared
        materials = shared.materials
        self._check_new(name in materials, definition)
        kind = definition.params.one("type", "string", None)
        if kind is None:
            raise definition.params.error("needs the parameter 'string type'")
        version = Definition(kind, definition.params, definition.state)
        materials.setdefault(name, []).append((shared.count, version))

    def _check_new(self, exists: bool, definition: Definition) -> None:
        """Raise SceneError for a name that is defined again; versions 2 and 3 allow that."""
        if exists and not self.contents.shared.old:
            raise definition.params.error("is already defined")

    def named_material(self) -> None:
        """Take a material for the shapes to come; version 3 keeps the former for unknown names."""
        self.only(True)
        name, shared = self.lexer.string("a name"), self.contents.shared
        if shared.old and name not in shared.materials:
            self.warn(f"there is no material {name!r} so far: the material before it stays")
            return
        self.state.material = name

    def texture(self) -> None:
        self.only(True)
        name = self.lexer.string("a name")
        values = self.lexer.string("float or spectrum")
        if values == "color" and self.contents.shared.old:
            values = "spectrum"
        if values == "color":
            raise SceneError(f"a texture of the type color is {UPGRADE}")
        if values not in ("float", "spectrum"):
            raise SceneError(f"a texture has values float or spectrum, not {values[:40]!r}")
        definition = self._definition(f'Texture "{name}" "{{}}"', "texture")
        shared = self.contents.shared
        textures = shared.textures
        self._check_new((values, name) in textures, definition)
        textures.setdefault((values, name), []).append((shared.count, definition))

    def make_named_medium(self) -> None:
        definition = self._definition('MakeNamedMedium "{}"', "medium", "a name")
        self.contents.shared.media[definition.kind] = definition

    def medium_interface(self) -> None:
        inside = self.lexer.string("the name of a medium")
        outside = self.lexer.string("") if self.lexer.peek().startswith(b'"') else inside
        self.state.inside, self.state.outside = inside, outside


DIRECTIVES = {
    "ActiveTransform": _Reader.active_transform,
    "AreaLightSource": _Reader.area_light_source,
    "Attribute": _Reader.attribute,
    "AttributeBegin": _Reader.attribute_begin,
    "AttributeEnd": _Reader.attribute_end,
    "ColorSpace": _Reader.colour_space,
    "ConcatTransform": _Reader.concat_transform,
    "CoordSysTransform": _Reader.coord_sys_transform,
    "CoordinateSystem": _Reader.coordinate_system,
    "Identity": _Reader.identity,
    "Import": _Reader.import_file,
    "Include": _Reader.include,
    "LightSource": _Reader.light_source,
    "LookAt": _Reader.look_at,
    "MakeNamedMaterial": _Reader.make_named_material,
    "MakeNamedMedium": _Reader.make_named_medium,
    "Material": _Reader.material,
    "MediumInterface": _Reader.medium_interface,
    "NamedMaterial": _Reader.named_material,
    "ObjectBegin": _Reader.object_begin,
    "ObjectEnd": _Reader.object_end,
    "ObjectInstance": _Reader.object_instance,
    "Option": _Reader.set_option,
    "ReverseOrientation": _Reader.reverse_orientation,
    "Rotate": _Reader.rotate,
    "Scale": _Reader.scale,
    "Shape": _Reader.shape,
    "Texture": _Reader.texture,
    "Transform": _Reader.transform,
    "TransformBegin": _Reader.transform_begin,
    "TransformEnd": _Reader.transform_end,
    "TransformTimes": _Reader.transform_times,
    "Translate": _Reader.translate,
    "WorldBegin": _Reader.world_begin,
    "WorldEnd": _Reader.world_end,
    **dict.fromkeys(OPTIONS, _Reader.option),
}
