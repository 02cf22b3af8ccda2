#!/usr/bin/env python3
"""Writes the maps that are too large to be written by hand.

    python3 missions/maps/generate.py [FOLDER]

Same maps every time: the numbers come from a small generator of our own, not from Python's.
W is ENU in metres, z = 0 is the surface.
"""

import math
import pathlib
import sys

FOLDER = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)


class Draw:
    """Park and Miller's minimal standard generator: the same on every machine."""

    def __init__(self, seed):
        self.state = seed

    def __call__(self, low=0.0, high=1.0):
        self.state = self.state * 48271 % 2147483647
        return low + (high - low) * self.state / 2147483647


def number(x):
    text = f"{x:.4f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def numbers(values):
    return " ".join(number(v) for v in values)


class Map:
    """An SDF world of static models, each with one link of named collisions."""

    def __init__(self, name, comment):
        self.name = name
        self.comment = comment
        self.models = {}

    def add(self, model, name, geometry, xyz, rpy=(0, 0, 0)):
        self.models.setdefault(model, []).append((name, geometry, (*xyz, *rpy)))

    def box(self, model, name, size, xyz, rpy=(0, 0, 0)):
        self.add(model, name, f"<box><size>{numbers(size)}</size></box>", xyz, rpy)

    def pipe(self, model, name, radius, a, b):
        """A cylinder from a to b."""
        d = [q - p for p, q in zip(a, b)]
        length = math.sqrt(sum(c * c for c in d))
        middle = [(p + q) / 2 for p, q in zip(a, b)]
        pitch = math.atan2(math.hypot(d[0], d[1]), d[2])
        yaw = math.atan2(d[1], d[0])
        geometry = (f"<cylinder><radius>{number(radius)}</radius>"
                    f"<length>{number(length)}</length></cylinder>")
        self.add(model, name, geometry, middle, (0, pitch, yaw))

    def sphere(self, model, name, radius, xyz):
        self.add(model, name, f"<sphere><radius>{number(radius)}</radius></sphere>", xyz)

    def ellipsoid(self, model, name, radii, xyz, rpy=(0, 0, 0)):
        self.add(model, name, f"<ellipsoid><radii>{numbers(radii)}</radii></ellipsoid>", xyz, rpy)

    def write(self):
        lines = ['<?xml version="1.0"?>', "<!-- Written by generate.py."]
        lines += [f"  {line}" if line else "" for line in self.comment.strip().splitlines()]
        lines[-1] += " -->"
        lines += ['<sdf version="1.9">', f'  <world name="{self.name}">']
        for model, parts in self.models.items():
            lines += [f'    <model name="{model}">', "      <static>true</static>",
                      '      <link name="link">']
            for name, geometry, pose in parts:
                lines.append(f'        <collision name="{name}"><pose>{numbers(pose)}</pose>'
                             f"<geometry>{geometry}</geometry></collision>")
            lines += ["      </link>", "    </model>"]
        lines += ["  </world>", "</sdf>", ""]
        (FOLDER / f"{self.name}.sdf").write_text("\n".join(lines))


def cluttered():
    m = Map("cluttered", """
A field of pipes, 40 m long. Four fences have to be passed: two of pillars, 1.55 m apart, that a
vehicle passes on its side, and two of beams, 1.55 m apart, that it passes level. With 0.6 m to
keep from either side it needs 1.34 m. Loose pipes stand and lie between the fences.""")
    width, depth, pillar = 12.0, 8.5, 0.15
    m.box("basin", "floor", (54, width + 12, 1), (19, 0, -depth - 0.5))
    m.box("basin", "side_north", (54, 1, depth), (19, width / 2 + 0.5, -depth / 2))
    m.box("basin", "side_south", (54, 1, depth), (19, -width / 2 - 0.5, -depth / 2))
    pitch = 1.55 + 2 * pillar
    for fence, x in enumerate((6.0, 22.0)):
        count = int(width / pitch)
        for i in range(count + 1):
            y = (i - count / 2) * pitch
            m.pipe(f"pillars_{fence}", f"pillar_{i}", pillar, (x, y, -depth), (x, y, 0))
    for fence, x in enumerate((14.0, 30.0)):
        for i in range(5):
            z = -0.5 - i * pitch
            m.pipe(f"beams_{fence}", f"beam_{i}", pillar, (x, -width / 2, z), (x, width / 2, z))
    draw = Draw(4711)
    for i, x in enumerate((9.5, 10.7, 17.5, 18.7, 25.5, 26.7, 34.0, 36.0)):
        if i % 3 == 2:
            z = draw(-6.5, -2.0)
            m.pipe("loose", f"pipe_{i}", 0.06, (x, -width / 2, z), (x, width / 2, z + draw(-1, 1)))
        else:
            y = draw(-3.5, 3.5)
            m.pipe("loose", f"pipe_{i}", 0.06, (x, y, -depth), (x + draw(-0.5, 0.5), y, 0))
    m.write()


def maze():
    m = Map("maze", """
A maze of upright pipes in rows, 5 x 4 cells of 3.2 m, open at its south-west and north-east
corners. Pipes stand 0.4 m apart: nothing swims between those of one row.""")
    cell, columns, rows, depth, step = 3.2, 5, 4, 5.0, 0.4
    draw = Draw(1912)
    # Depth-first: every cell is reached by one way only.
    open_walls = set()
    seen = {(0, 0)}
    stack = [(0, 0)]
    while stack:
        c, r = stack[-1]
        around = [(c + dc, r + dr) for dc, dr in ((1, 0), (0, 1), (-1, 0), (0, -1))]
        around = [n for n in around
                  if 0 <= n[0] < columns and 0 <= n[1] < rows and n not in seen]
        if not around:
            stack.pop()
            continue
        n = around[int(draw(0, len(around)))]
        open_walls.add(frozenset((stack[-1], n)))
        seen.add(n)
        stack.append(n)
    m.box("seabed", "ground", (60, 60, 1), (8, 6.4, -depth - 0.5))
    places = set()

    def wall(x0, y0, x1, y1):
        count = round(math.hypot(x1 - x0, y1 - y0) / step)
        for i in range(count + 1):
            places.add((round(x0 + (x1 - x0) * i / count, 3), round(y0 + (y1 - y0) * i / count, 3)))

    for c in range(columns):
        for r in range(rows):
            x, y = c * cell, r * cell
            if r == 0:
                wall(x, y, x + cell, y)
            if c == 0 and r > 0:
                wall(x, y, x, y + cell)
            if r == rows - 1 or frozenset(((c, r), (c, r + 1))) not in open_walls:
                wall(x, y + cell, x + cell, y + cell)
            last = (c, r) == (columns - 1, rows - 1)
            if not last and (c == columns - 1 or
                             frozenset(((c, r), (c + 1, r))) not in open_walls):
                wall(x + cell, y, x + cell, y + cell)
    for i, (x, y) in enumerate(sorted(places)):
        m.pipe("maze", f"pipe_{i}", 0.06, (x, y, -depth), (x, y, 0))
    m.write()


def transect():
    m = Map("transect", """
Two hundred metres of seabed at 12 m, with boulders, some of them tall, and a few moorings.""")
    draw = Draw(200)
    m.box("seabed", "ground", (260, 60, 1), (100, 0, -12.5))
    for i in range(120):
        r = draw(0.3, 1.6) if i % 6 else draw(1.6, 3.0)
        m.ellipsoid("boulders", f"boulder_{i}", (r * draw(0.8, 1.6), r * draw(0.8, 1.6), r),
                    (draw(3, 197), draw(-14, 14), -12 + 0.4 * r), (0, 0, draw(0, math.pi)))
    for i in range(12):
        x, y = draw(8, 192), draw(-5, 5)
        m.pipe("moorings", f"rope_{i}", 0.03, (x, y, -12), (x, y, -2))
        m.sphere("moorings", f"float_{i}", 0.3, (x, y, -1.8))
    m.write()


def wreck():
    m = Map("wreck", """
A small freighter upright on the seabed, bow to the east, 26 m long and 7 m wide: double hull of
plates, a hold under an open hatch, an engine room behind a bulkhead with a door, a deckhouse with
doors on both sides. The engine room has steel above it.""")
    floor = -15.0
    keel, deck, beam, plate = floor, floor + 6.0, 7.0, 0.1
    m.box("seabed", "ground", (80, 60, 1), (0, 0, floor - 0.5))
    # Frames of the hull from stern (x = -13) to bow (x = 13): half width at each.
    stations = [(-13, 2.4), (-10, 3.3), (-5, 3.5), (5, 3.5), (9, 2.8), (12, 1.2), (13, 0.05)]
    for i, ((x0, w0), (x1, w1)) in enumerate(zip(stations, stations[1:])):
        length = math.hypot(x1 - x0, w1 - w0)
        yaw = math.atan2(w1 - w0, x1 - x0)
        for side, sign in (("port", 1), ("starboard", -1)):
            middle = ((x0 + x1) / 2, sign * (w0 + w1) / 2, (keel + deck) / 2)
            if side == "port" and (x0, x1) == (-5, 5):
                # A gash amidships, 2.6 m wide from the seabed up to 2.8 m.
                for name, a, b, z0, z1 in (("aft", -5, -1.3, keel, deck),
                                           ("fore", 1.3, 5, keel, deck),
                                           ("above", -1.3, 1.3, keel + 2.8, deck)):
                    m.box("hull", f"port_{i}_{name}", (b - a, plate, z1 - z0),
                          ((a + b) / 2, 3.5, (z0 + z1) / 2))
                continue
            m.box("hull", f"{side}_{i}", (length + 0.05, plate, deck - keel), middle,
                  (0, 0, sign * yaw))
    m.box("hull", "transom", (plate, 4.8, deck - keel), (-13, 0, (keel + deck) / 2))
    # Bulkheads. The one before the engine room has a door 2.0 m wide and 2.6 m high.
    height = deck - keel
    for name, x, half, door in (("engine_room", -5.0, 3.5, True), ("collision", 9.0, 2.8, False)):
        if not door:
            m.box("bulkheads", name, (plate, 2 * half, height), (x, 0, (keel + deck) / 2))
            continue
        side = half - 1.0
        for part, y in (("port", 1.0 + side / 2), ("starboard", -1.0 - side / 2)):
            m.box("bulkheads", f"{name}_{part}", (plate, side, height), (x, y, (keel + deck) / 2))
        m.box("bulkheads", f"{name}_above", (plate, 2.0, height - 3.0), (x, 0, keel + 3.0 +
                                                                        (height - 3.0) / 2))
        m.box("bulkheads", f"{name}_sill", (plate, 2.0, 0.4), (x, 0, keel + 0.2))
    # Deck: closed over the engine room and the bow, a hatch of 5 x 4 m over the hold.
    m.box("deck", "aft", (8.0, beam, plate), (-9.0, 0, deck))
    m.box("deck", "before_hatch", (6.0, beam, plate), (6.0, 0, deck))
    m.box("deck", "after_hatch", (3.0, beam, plate), (-3.5, 0, deck))
    for side, sign in (("port", 1), ("starboard", -1)):
        m.box("deck", f"beside_hatch_{side}", (5.0, 1.5, plate), (0.5, sign * 2.75, deck))
    # Deckhouse on the after deck with a door on each side, and the stump of a mast.
    top = deck + 2.8
    for name, x in (("aft", -12.0), ("fore", -7.0)):
        m.box("deckhouse", name, (plate, 4.4, 2.8), (x, 0, deck + 1.4))
    for side, sign in (("port", 1), ("starboard", -1)):
        m.box("deckhouse", f"{side}_aft", (1.6, plate, 2.8), (-11.2, sign * 2.2, deck + 1.4))
        m.box("deckhouse", f"{side}_fore", (1.6, plate, 2.8), (-7.8, sign * 2.2, deck + 1.4))
    m.box("deckhouse", "roof", (5.1, 4.5, plate), (-9.5, 0, top))
    m.pipe("rigging", "mast", 0.2, (6.5, 0, deck), (6.5, 0, deck + 5))
    m.pipe("rigging", "boom", 0.12, (6.5, 0, deck + 2), (0.5, 1.8, deck + 0.4))
    # What lies in the hold and the engine room.
    m.box("engine", "block", (2.8, 1.2, 1.6), (-9.6, -1.0, keel + 0.8))
    m.pipe("engine", "shaft", 0.15, (-11.0, 0.6, keel + 0.5), (-13.0, 0.6, keel + 0.5))
    draw = Draw(1917)
    for i in range(10):
        size = (draw(0.4, 1.0), draw(0.4, 1.0), draw(0.3, 0.8))
        m.box("cargo", f"crate_{i}", size,
              (draw(-4.0, 8.0), draw(-2.8, -0.9), keel + size[2] / 2), (0, 0, draw(0, math.pi)))
    m.write()


def pool(m):
    """The deep pool of the AquaNav paper, 25 x 15 x 4 m, west wall at x = 0."""
    m.box("pool", "floor", (26, 16, 0.5), (12.5, 0, -4.25))
    m.box("pool", "north", (26, 0.5, 4), (12.5, 7.75, -2))
    m.box("pool", "south", (26, 0.5, 4), (12.5, -7.75, -2))
    m.box("pool", "west", (0.5, 15, 4), (-0.25, 0, -2))
    m.box("pool", "east", (0.5, 15, 4), (25.25, 0, -2))


def toys(m):
    """Bricks, balls and sticks on the floor of that pool, 0.4 m high at most."""
    draw = Draw(2020)
    for i in range(48):
        x, y = 1.2 + 0.48 * i, draw(0.1, 2.4) * (-1) ** i
        if i % 3 == 0:
            size = (draw(0.2, 0.5), draw(0.2, 0.5), draw(0.1, 0.4))
            m.box("toys", f"brick_{i}", size, (x, y, -4 + size[2] / 2), (0, 0, draw(0, math.pi)))
        elif i % 3 == 1:
            r = draw(0.08, 0.2)
            m.sphere("toys", f"ball_{i}", r, (x, y, r - 4))
        else:
            r, half, yaw = draw(0.03, 0.06), draw(0.15, 0.4), draw(0, math.pi)
            dx, dy = half * math.cos(yaw), half * math.sin(yaw)
            m.pipe("toys", f"stick_{i}", r, (x - dx, y - dy, r - 4), (x + dx, y + dy, r - 4))


def pool_obstacles():
    m = Map("pool_obstacles", """
The deep pool, toys on its floor, and two upright columns, 2.3 m apart. The line from the start
to the goal meets the north one. A level vehicle that keeps 0.6 m from both needs 1.64 m.""")
    pool(m)
    radius, gap = 0.3, 2.3
    north = 0.45
    for name, y in (("north", north), ("south", north - gap - 2 * radius)):
        m.pipe("columns", name, radius, (12, y, -4), (12, y, 0))
    toys(m)
    m.write()


def pool_diver():
    m = Map("pool_diver", """
The deep pool with toys on its floor, and nothing else: the diver swims in it.""")
    pool(m)
    toys(m)
    m.write()


cluttered()
maze()
transect()
wreck()
pool_obstacles()
pool_diver()
