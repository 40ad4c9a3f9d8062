"""Scenes of families for tests: chains, rings, nets, all pairs."""


def chain(n, *, ends="fixed", masses="equal", power=2, numbered=False):
    """Masses on a line joined by springs, between walls or free, or closed to a ring."""

    def name(k):
        return f"x{k}" if numbered else f"x[{k}]"

    mass = {
        "equal": lambda k: "m",
        "alternating": lambda k: "m" if k % 2 else "M",
        "own": lambda k: f"m[{k}]",
        "growing": lambda k: f"{k}*m",
    }[masses]
    springs = [f"k/2*({name(k + 1)} - {name(k)})^{power}" for k in range(1, n)]
    if ends == "fixed":
        springs += [f"k/2*{name(1)}^{power}", f"k/2*{name(n)}^{power}"]
    if ends == "ring":
        springs.append(f"k/2*({name(1)} - {name(n)})^{power}")
    parameters = {"k": 2, **({"m": 1} if masses in ("equal", "growing") else {})}
    parameters |= {"m": 1, "M": 3} if masses == "alternating" else {}
    parameters |= {f"m[{k}]": k * k + 1 for k in range(1, n + 1)} if masses == "own" else {}
    lines = ["name: chain", "parameters:"]
    lines += [f'  "{p}": {value}' for p, value in parameters.items()]
    lines += [f"coordinates: [{', '.join(quoted(name(k)) for k in range(1, n + 1))}]", "kinetic:"]
    lines += [f"  t{k}: {mass(k)}*dot({name(k)})^2/2" for k in range(1, n + 1)]
    lines += ["potentials:", *(f"  v{k}: {v}" for k, v in enumerate(springs))]
    return "\n".join(lines) + "\n"


def declared_chain(n, *, walls=True):
    """The same with families and definitions beyond the ends."""
    ends = "definitions: {'u[0]': 0, 'u[n+1]': 0}" if walls else ""
    first, last = ("0", "n") if walls else ("1", "n-1")
    return f"""
name: chain
sizes: {{n: {n}}}
parameters: {{m: 1, k: 2}}
coordinates: ["u[i=1..n]"]
{ends}
kinetic: {{all: "sum(m*dot(u[i])^2/2, i=1..n)"}}
potentials: {{all: "sum(k/4*(u[i+1] - u[i])^4, i={first}..{last})"}}
"""


def net(n, m, *, frame=True):
    """Beads in a rectangle of springs, within a frame or free at the edges."""
    edges = (
        """
definitions:
  u[0, j=1..m]: 0
  u[n+1, j=1..m]: 0
  u[i=1..n, 0]: 0
  u[i=1..n, m+1]: 0
"""
        if frame
        else ""
    )
    a, b = (0, "") if frame else (1, "-1")
    return f"""
name: net
sizes: {{n: {n}, m: {m}}}
parameters: {{mass: 1, k: 2}}
coordinates: ["u[i=1..n, j=1..m]"]
{edges}
kinetic: {{all: "sum(mass*dot(u[i,j])^2/2, i=1..n, j=1..m)"}}
potentials:
  down: "sum(k/2*(u[i+1,j] - u[i,j])^2, i={a}..n{b}, j=1..m)"
  along: "sum(k/2*(u[i,j+1] - u[i,j])^2, i=1..n, j={a}..m{b})"
"""


def pairs(n, *, masses="own"):
    """Bodies in a plane that attract each other."""
    mass = {"own": "m[{}]", "equal": "m", "growing": "{}"}[masses]
    parameters = {"own": [f'"m[{k}]": {k * k}' for k in range(1, n + 1)], "equal": ["m: 2"]}
    listed = ["G: 1", *parameters.get(masses, [])]
    bodies = [
        f"  star{k}: {{mass: '{mass.format(k)}', position: [x{k}, y{k}, z{k}]}}"
        for k in range(1, n + 1)
    ]
    places = [f"{axis}{k}" for axis in "xy" for k in range(1, n + 1)]
    terms = [
        f"  pair{i}_{j}: -G*{mass.format(i)}*{mass.format(j)}/norm(x{i} - x{j}, y{i} - y{j})"
        for i in range(1, n + 1)
        for j in range(i + 1, n + 1)
    ]
    return "\n".join(
        [
            "name: stars",
            f"parameters: {{{', '.join(listed)}}}",
            "plane: xy",
            "particles:",
            *bodies,
            f"coordinates: [{', '.join(places)}]",
            "potentials:",
            *terms,
            "",
        ]
    )


def quoted(name):
    return f'"{name}"'
