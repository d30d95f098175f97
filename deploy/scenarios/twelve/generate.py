#!/usr/bin/env python3
"""Draws maps and target motions of the twelve scenarios: generate.py --out DIR [--seed N] [--only S5,S12].

Seed 1 gives the files in this folder, byte for byte; any other seed gives scenarios of the same
difficulty. A map is a 40 m x 30 m field of cylinders with a least gap between them. The target drives
at 1 m/s from gap to gap and hugs the obstacles at a wanted clearance. A motion is taken when its
clearance and curvature are as wanted, a quintic follows it over every horizon, and a planar search
shows that a chaser at up to 3 m/s can follow it in sight. Python's standard library only."""

import argparse
import heapq
import math
import pathlib
import sys

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "launcher"))
sys.dont_write_bytecode = True
import version  # noqa: E402

WIDTH, HEIGHT = 40.0, 30.0  # of the field, m
DURATION, MARGIN_TIME, SPEED = 50.0, 5.0, 1.0  # s, s (the last horizon), m/s
STEP = 0.05  # of a path, m
CELL = 0.1  # of the route search, m
GROWTH = 0.30  # radius of the drone, m
TARGET_HEIGHT = 1.0  # m
DESIRED = 3.0  # distance, m
MAX_CURVATURE, MAX_FIT_ERROR = 1.2, 0.05  # 1/m, m
MAPS = {1: (24, 2.6), 2: (40, 2.2), 3: (60, 1.8), 4: (84, 1.4)}  # obstacles, least gap [m]
CLEARANCES = [1.2, 1.1, 1.0, 0.95, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.55, 0.5]  # of S1 to S12, m


class Random:
    """splitmix64 (Steele, Lea, Flood 2014)."""

    MASK = (1 << 64) - 1

    def __init__(self, seed):
        self.state = seed & self.MASK

    def uniform(self, low, high):
        self.state = (self.state + 0x9E3779B97F4A7C15) & self.MASK
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & self.MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & self.MASK
        return low + (high - low) * (((z ^ (z >> 31)) >> 11) * (1.0 / 9007199254740992.0))


# ---- maps ----


def draw_map(number, seed):
    """Obstacles (x, y, radius) by dart throwing."""
    count, gap = MAPS[number]
    random = Random(100 * seed + number)
    obstacles = []
    for _ in range(2000000):
        x, y = random.uniform(1.5, WIDTH - 1.5), random.uniform(1.5, HEIGHT - 1.5)
        radius = random.uniform(0.3, 0.6)
        if all(math.hypot(x - a, y - b) - radius - c >= gap for a, b, c in obstacles):
            obstacles.append((x, y, radius))
        if len(obstacles) == count:
            return obstacles
    raise RuntimeError(f"map {number}, seed {seed}: no room for {count} obstacles")


def clearance(obstacles, x, y):
    """Distance from a point to the nearest surface."""
    return min(math.hypot(x - a, y - b) - r for a, b, r in obstacles)


def gates(obstacles):
    """Middle and width of the gap of every pair with no third obstacle in between (Gabriel)."""
    found = []
    for i, a in enumerate(obstacles):
        for j, b in enumerate(obstacles[:i]):
            d = math.hypot(a[0] - b[0], a[1] - b[1])
            mx, my = (a[0] + b[0]) / 2, (a[1] + b[1]) / 2
            if d > 10 or any(k not in (i, j) and math.hypot(mx - c[0], my - c[1]) < d / 2
                             for k, c in enumerate(obstacles)):
                continue
            ux, uy = (b[0] - a[0]) / d, (b[1] - a[1]) / d
            gap = d - a[2] - b[2]
            t = a[2] + gap / 2
            found.append((a[0] + ux * t, a[1] + uy * t, gap))
    return found


# ---- routes ----


class Grid:
    """Clearance at the middles of cells, and shortest ways over cells that keep enough of it."""

    def __init__(self, obstacles):
        self.nx, self.ny = int(WIDTH / CELL), int(HEIGHT / CELL)
        self.value = [[clearance(obstacles, (i + .5) * CELL, (j + .5) * CELL)
                       for j in range(self.ny)] for i in range(self.nx)]

    def free(self, cell, keep):
        i, j = cell
        return 5 <= i < self.nx - 5 and 5 <= j < self.ny - 5 and self.value[i][j] >= keep

    def way(self, start, goal, keep):
        """8-connected A* from point to point; None when there is no way."""
        start, goal = (tuple(int(c / CELL) for c in p[:2]) for p in (start, goal))
        if not self.free(start, keep) or not self.free(goal, keep):
            return None
        length, before, queue, done = {start: 0.0}, {}, [(0.0, start)], set()
        while queue:
            _, cell = heapq.heappop(queue)
            if cell in done:
                continue
            done.add(cell)
            if cell == goal:
                return self.points(before, cell)
            for di in (-1, 0, 1):
                for dj in (-1, 0, 1):
                    other = (cell[0] + di, cell[1] + dj)
                    if other == cell or other in done or not self.free(other, keep):
                        continue
                    d = length[cell] + math.hypot(di, dj)
                    if d < length.get(other, 1e18):
                        length[other], before[other] = d, cell
                        ahead = math.hypot(other[0] - goal[0], other[1] - goal[1])
                        heapq.heappush(queue, (d + ahead, other))
        return None

    @staticmethod
    def points(before, cell):
        cells = [cell]
        while cell in before:
            cell = before[cell]
            cells.append(cell)
        return [((i + .5) * CELL, (j + .5) * CELL) for i, j in cells[::-1]]


def pull(obstacles, points, keep):
    """Straightens a way as far as the clearance allows."""

    def clear(p, q):
        n = max(1, int(math.dist(p, q) / 0.05))
        return all(clearance(obstacles, p[0] + (q[0] - p[0]) * k / n,
                             p[1] + (q[1] - p[1]) * k / n) >= keep for k in range(n + 1))

    pulled, i = [points[0]], 0
    while i < len(points) - 1:
        j = min(len(points) - 1, i + 120)
        while j > i + 1 and not clear(points[i], points[j]):
            j -= 1
        pulled.append(points[j])
        i = j
    return pulled


def turn(a, b):
    """Angle from direction a to direction b, wrapped."""
    return (b - a + math.pi) % (2 * math.pi) - math.pi


def draw_route(obstacles, grid, gaps, keep, seed, length):
    """From gate to gate, hops of 5 to 14 m, turns of at most 75 degrees, until it is long enough."""
    for attempt in range(200):
        random = Random(seed + 7919 * attempt)
        wide = [g for g in gaps if g[2] / 2 >= keep + 0.1 and 2 < g[0] < WIDTH - 2
                and 2 < g[1] < HEIGHT - 2]
        if not wide:
            return None
        here, before = wide[int(random.uniform(0, len(wide)))], None
        route, driven, misses = [(here[0], here[1])], 0, 0
        while driven < length and misses < 400:
            goal = wide[int(random.uniform(0, len(wide)))]
            misses += 1
            if not 5 <= math.dist(goal[:2], here[:2]) <= 14:
                continue
            if before is not None:
                came = math.atan2(here[1] - before[1], here[0] - before[0])
                goes = math.atan2(goal[1] - here[1], goal[0] - here[0])
                if abs(turn(came, goes)) > math.radians(75):
                    continue
            way = grid.way(here, goal, keep)
            if not way:
                continue
            way = pull(obstacles, way, keep)
            driven += sum(math.dist(a, b) for a, b in zip(way, way[1:]))
            route += way[1:]
            before, here = here, goal
            misses -= 1
        if driven >= length:
            return route
    return None


# ---- paths ----


def resample(points, step):
    """Points at equal spacing along a polygon, and its length."""
    at = [0.]
    for a, b in zip(points, points[1:]):
        at.append(at[-1] + math.dist(a, b))
    out, k = [], 0
    for i in range(int(at[-1] / step) + 1):
        s = i * step
        while k < len(at) - 2 and at[k + 1] < s:
            k += 1
        w = (s - at[k]) / max(1e-12, at[k + 1] - at[k])
        p, q = points[k], points[k + 1]
        out.append((p[0] + w * (q[0] - p[0]), p[1] + w * (q[1] - p[1])))
    return out, at[-1]


def smooth(points, window, rounds):
    """Moving average over `window` metres, narrower near the ends."""
    half = int(window / STEP / 2)
    for _ in range(rounds):
        sums = [(0., 0.)]
        for x, y in points:
            sums.append((sums[-1][0] + x, sums[-1][1] + y))
        n = len(points)
        averaged = []
        for i in range(n):
            k = min(half, i, n - 1 - i)
            a, b = sums[i - k], sums[i + k + 1]
            averaged.append(((b[0] - a[0]) / (2 * k + 1), (b[1] - a[1]) / (2 * k + 1)))
        points = averaged
    return points


def relax(obstacles, points, wanted):
    """Smooths, and pushes out of the clearance again, by turns."""
    keep = wanted + 0.05
    for _ in range(14):
        points = smooth(points, 2.4, 1)
        for i, (x, y) in enumerate(points):
            b = min(obstacles, key=lambda o: math.hypot(x - o[0], y - o[1]) - o[2])
            d = math.hypot(x - b[0], y - b[1])
            if d - b[2] < keep:
                f = (b[2] + wanted + 0.05) / d
                points[i] = (b[0] + (x - b[0]) * f, b[1] + (y - b[1]) * f)
    return resample(smooth(points, 1.2, 2), STEP)


# ---- what is asked of a motion ----


def solve(A, b):
    """Gaussian elimination with pivoting."""
    n = len(b)
    M = [A[r][:] + [b[r]] for r in range(n)]
    for c in range(n):
        pivot = max(range(c, n), key=lambda r: abs(M[r][c]))
        M[c], M[pivot] = M[pivot], M[c]
        for r in range(n):
            if r != c:
                f = M[r][c] / M[c][c]
                for q in range(c, n + 1):
                    M[r][q] -= f * M[c][q]
    return [M[r][n] / M[r][r] for r in range(n)]


def fit_error(points, first, n):
    """Largest distance of n + 1 points from their least-squares quintic."""
    chosen = range(0, n + 1, 2)
    basis = [[(2 * i / n - 1) ** p for p in range(6)] for i in chosen]
    A = [[sum(b[r] * b[c] for b in basis) for c in range(6)] for r in range(6)]
    fits = []
    for d in (0, 1):
        y = [points[first + i][d] for i in chosen]
        fits.append(solve(A, [sum(basis[q][r] * y[q] for q in range(len(basis)))
                              for r in range(6)]))
    return max(math.hypot(*(sum(fits[d][r] * b[r] for r in range(6)) - points[first + i][d]
                            for d in (0, 1))) for b, i in zip(basis, chosen))


def is_wanted(obstacles, points, wanted):
    n = int(SPEED * (DURATION + MARGIN_TIME) / STEP)
    least = min(clearance(obstacles, *p) for p in points[:n + 1])
    heading = [math.atan2(points[i + 4][1] - points[i][1], points[i + 4][0] - points[i][0])
               for i in range(n)]
    curvature = max(abs(turn(heading[i], heading[i + 4])) / (4 * STEP) for i in range(n - 9))
    horizon = int(round(SPEED * MARGIN_TIME / STEP))
    error = max(fit_error(points, i, horizon) for i in range(0, n - horizon, 20))
    return wanted - 0.05 <= least <= wanted + 0.10 and curvature <= MAX_CURVATURE \
        and error <= MAX_FIT_ERROR


def segment_distance(a, b, c):
    vx, vy = b[0] - a[0], b[1] - a[1]
    length = vx * vx + vy * vy
    t = 0 if length == 0 else max(0, min(1, ((c[0] - a[0]) * vx + (c[1] - a[1]) * vy) / length))
    return math.hypot(a[0] + t * vx - c[0], a[1] + t * vy - c[1])


def can_be_followed(obstacles, targets, growth=GROWTH, speed=3.0, near=1.5, far=4.5, h=0.5):
    """Planar reachable set on a grid of h metres in steps of 0.5 s: is there always a place from
    which the target is seen, reached along a free segment that keeps sight?"""

    def clear(p, q, nearby):
        return all(segment_distance(p, q, o) > o[2] + growth for o in nearby)

    before, last = None, None
    for t in targets:
        nearby = [o for o in obstacles if math.hypot(t[0] - o[0], t[1] - o[1]) - o[2] < 7.0]
        cells = [(i * h, j * h)
                 for i in range(int((t[0] - far) / h), int((t[0] + far) / h) + 2)
                 for j in range(int((t[1] - far) / h), int((t[1] + far) / h) + 2)]
        here = [p for p in cells if near <= math.dist(p, t) <= far and clear(p, t, nearby)]
        if before is not None:
            middle = ((t[0] + last[0]) / 2, (t[1] + last[1]) / 2)
            here = [p for p in here if any(
                math.dist(p, q) <= speed * 0.5 and clear(p, q, nearby)
                and clear(((p[0] + q[0]) / 2, (p[1] + q[1]) / 2), middle, nearby)
                for q in before)]
        if not here:
            return False
        before, last = here, t
    return True


def draw_motion(number, obstacles, grid, gaps, seed):
    """The path of scenario `number`, a point each 0.05 m."""
    wanted = CLEARANCES[number - 1]
    length = SPEED * (DURATION + MARGIN_TIME)
    which = 1000 * ((number - 1) // 3 + 1) + (number - 1) % 3 + 1
    for retry in range(25):
        route = draw_route(obstacles, grid, gaps, wanted + 0.05,
                           10000000 * (seed - 1) + which + 100000 * retry, length + 6)
        if not route:
            continue
        points, driven = relax(obstacles, resample(route, STEP)[0], wanted)
        if driven < length or len(points) < length / STEP + 5:
            continue
        if not is_wanted(obstacles, points, wanted):
            continue
        if can_be_followed(obstacles, [points[i * 10] for i in range(111)]):
            return points
    return None


# ---- files ----

SCENARIO = """\
name: {name}
description: Map {map} of the comparison, motion {motion}; the target is known over the horizon.
duration_s: {duration:g}
settle_s: 10
sensors: {{mode: truth}}
target: {{path_file: {path}, speed: {speed:g}, base: 0.75, height: 0.5, carrier_size: [0.5, 0.4, 0.7]}}
chaser: {{start: [{x:.4f}, {y:.4f}, 0], yaw_deg: {yaw:.2f}, takeoff_height: {z:g}, desired_distance: {desired:g}, radius: {growth:g}}}
criteria: {{safe_ratio: 1, visible_ratio: 1, in_image_ratio: -1}}
services:
  - name: planning
    config: |
{planning}
world:
  ellipsoids:
"""


def start_place(obstacles, target):
    """On the ring of the desired distance, of 16 bearings the one whose sight is clearest."""

    def least(angle):
        p = (target[0] + DESIRED * math.cos(angle), target[1] + DESIRED * math.sin(angle))
        return min(segment_distance(p, target, o) / (o[2] + GROWTH) for o in obstacles)

    angle = max((2 * math.pi * k / 16 for k in range(16)), key=least)
    return target[0] + DESIRED * math.cos(angle), target[1] + DESIRED * math.sin(angle), angle


def write_scenario(folder, name, number, obstacles, points):
    """NAME.yaml and the target's path beside it (t, x, y each 0.1 s)."""
    path = f"S{number:02d}{name.lstrip('S0123456789')}_target.csv"
    with open(folder / path, "w", encoding="ascii") as out:
        out.write("t,x,y\n")
        for i in range(551):
            out.write("%.2f,%.4f,%.4f\n" % (i * 0.1, *points[i * 2]))
    x, y, angle = start_place(obstacles, points[0])
    planning = (pathlib.Path(__file__).resolve().parent / "planning.yaml").read_text(encoding="ascii")
    with open(folder / f"{name}.yaml", "w", encoding="ascii") as out:
        out.write(SCENARIO.format(
            name=name, map=(number - 1) // 3 + 1, motion=(number - 1) % 3 + 1, duration=DURATION,
            path=path, speed=SPEED, x=x, y=y, z=TARGET_HEIGHT, yaw=math.degrees(angle) - 180.0,
            desired=DESIRED, growth=GROWTH,
            planning="".join("      " + line for line in planning.splitlines(True)).rstrip()))
        for a, b, r in obstacles:
            out.write(f"    - {{center: [{a:.4f}, {b:.4f}, {TARGET_HEIGHT:g}], "
                      f"radii: [{r:.4f}, {r:.4f}, 5.7]}}\n")


def write_map(folder, name, obstacles):
    with open(folder / name, "w", encoding="ascii") as out:
        out.write("x,y,r\n")
        for obstacle in obstacles:
            out.write("%.4f,%.4f,%.4f\n" % obstacle)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--version", action="version", version=version.text())
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder for the files")
    parser.add_argument("--seed", type=int, default=1, help="1: the twelve of the comparison")
    parser.add_argument("--only", default="", help="scenarios, such as S5,S12 (default: all)")
    arguments = parser.parse_args()
    only = {int(s.lstrip("S")) for s in arguments.only.split(",") if s} or set(range(1, 13))
    arguments.out.mkdir(parents=True, exist_ok=True)
    suffix = "" if arguments.seed == 1 else f"-seed{arguments.seed}"
    for number in range(1, 5):
        mine = [s for s in range(3 * number - 2, 3 * number + 1) if s in only]
        if not mine:
            continue
        obstacles = draw_map(number, arguments.seed)
        grid, gaps = Grid(obstacles), gates(obstacles)
        write_map(arguments.out, f"map{number}{suffix}.csv", obstacles)
        for scenario in mine:
            points = draw_motion(scenario, obstacles, grid, gaps, arguments.seed)
            if points is None:
                print(f"S{scenario}{suffix}: no motion as wanted in this map", file=sys.stderr)
                continue
            write_scenario(arguments.out, f"S{scenario}{suffix}", scenario, obstacles, points)
            print(f"S{scenario}{suffix}", flush=True)


if __name__ == "__main__":
    main()
