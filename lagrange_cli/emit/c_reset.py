"""``events`` and ``reset`` of C with one-sided constraints: what opens, closes and bounces.

At an event the closed contacts take an impact where one of them approaches, by
Newton's law with impulses that only push (Moreau, *Unilateral contact and dry
friction in finite freedom dynamics*, 1988; Glocker and Pfeiffer, *Nonlinear
Dynamics* 7 (1995) 471): w = u⁺ + e·min(u⁻, 0) ≥ 0, Λ ≥ 0, w·Λ = 0 for the rates u.
Those that do not leave then are in contact where they have to push, λ ≥ 0,
φ̈ ≥ 0, λ·φ̈ = 0. Both are the optimality conditions of a projection in the
metric of the kinetic energy, which the dual method of Goldfarb and Idnani finds
(*Math. Programming* 27 (1983) 1): it copes with contacts that depend on others.
"""

from __future__ import annotations

from collections.abc import Mapping

from lagrange_cli.emit.c_body import work_size
from lagrange_cli.emit.c_names import CNames
from lagrange_cli.emit.c_pushes import push_replacements, push_templates
from lagrange_cli.emit.c_target import CTarget
from lagrange_cli.emit.constants import IMPACT_TOLERANCES, RATE_TOLERANCE
from lagrange_cli.emit.program import Program, results_of

__all__ = ["reset_text", "reset_workspace"]

_EVENTS = """\
@STATIC@int @NAME@_@OF@events(@ARGUMENTS@)
{
@CONTACT@    @REAL@ *const found = work + @START@;
    int k, closed = 0, status = @NAME@_gaps(@PASSED@, work, found);
    for (k = 0; k < @U@; ++k) {
        closed = closed || contact[k] > @ZERO@;
        out[k] = found[k];
    }
    if (status != 0 || !closed) {
        return status;
    }
    status = @NAME@_contact_multipliers(@PASSED@, work, found);
    for (k = 0; k < @U@; ++k) {
        out[k] = contact[k] > @ZERO@ ? found[@M@ + k] : out[k];
    }
    return status;
}
"""

_STRUCTURE = """\
/*
 * What is known of the contacts at an event: gaps with their magnitudes; terms
 * (gradients by rows, rates, biases, restitutions); which were in contact and
 * which are closed (1 or 0); rates or accelerations w of the gaps, with the
 * magnitudes they are the sum of, and the pushes x that they take; d[j, k], what
 * a unit of push k adds to w[j]; which pushes are active.
 */
typedef struct {
    @REAL@ *gap, *gradient, *rate, *bias, *restitution;
    @REAL@ *held, *closed, *speed, *w, *size, *x, *active, *d, *change, *more;
} @NAME@_closing;
"""

_IMPACT = """\
/* The rate of gap k, and the magnitudes it is the sum of. */
static @REAL@ @NAME@_speed(int k, const @REAL@ *y, const @NAME@_closing *c, @REAL@ *size)
{
    @REAL@ speed = c->rate[k];
    int i;
    *size = @FABS@(speed);
    for (i = 0; i < @N@; ++i) {
        const @REAL@ term = c->gradient[k*@N@ + i]*y[@N@ + i];
        speed += term;
        *size += @FABS@(term);
    }
    return speed;
}

/* gap and terms at a state; what is closed; rates of the gaps with their magnitudes. */
static int @NAME@_look(@STATE@, int event, @REAL@ *work, @NAME@_closing *c)
{
@CONTACT@    int k, status = @NAME@_gaps(@PASSED@, work, c->gap);
    if (status == 0) {
        status = @NAME@_gap_terms(@PASSED@, work, c->gradient);
    }
    for (k = 0; k < @U@ && status == 0; ++k) {
        const @REAL@ speed = @NAME@_speed(k, y, c, &c->size[k]);
        /* What closes within the rounding error of the time closes now. */
        const @REAL@ late = @ULPS@*@FABS@(t)*@MIN@(speed, @ZERO@);
        const @REAL@ near = @TOLERANCE@*c->gap[@U@ + k] - late;
        c->held[k] = contact[k] > @ZERO@ ? @ONE@ : @ZERO@;
        c->closed[k] = contact[k] > @ZERO@ || k == event || c->gap[k] <= near ? @ONE@ : @ZERO@;
        c->speed[k] = speed;
    }
    return status;
}

/* d: the rates that a unit impulse of each closed contact adds, as parts of its own. */
static int @NAME@_respond(@MUTABLE@, @REAL@ *work, @NAME@_closing *c)
{
@CHANGING@    int i, j, k;
    for (k = 0; k < @U@; ++k) {
        int status = 1;
        for (j = 0; j < @U@; ++j) {
            contact[j] = contact[@U@ + j] = j == k ? @ONE@ : @ZERO@;
        }
        if (c->closed[k] > @ZERO@) {
            status = @NAME@_impulse(@PASSED@, work, c->change);
        }
        if (status > 1) {
            return status;
        }
        /* One that the closures alone hold back (1) takes no impulse. */
        for (j = 0; j < @U@; ++j) {
            @REAL@ *const of = c->d + j*@U@ + k;
            *of = @ZERO@;
            for (i = 0; i < @N@ && status == 0; ++i) {
                *of += c->gradient[j*@N@ + i]*c->change[i];
            }
        }
    }
    return 0;
}

/* The impact of what is closed: v changes, and speed becomes the rates after it. */
static int @NAME@_hit(@MUTABLE_STATE@, @REAL@ bounce, @REAL@ *work, @NAME@_closing *c)
{
@CHANGING@    int i, k, round, status;
    for (k = 0; k < @U@; ++k) {
        const @REAL@ e = c->restitution[k];
        if (c->closed[k] > @ZERO@ && !(e >= @ZERO@ && e <= @ONE@ + @TOLERANCE@)) {
            return @NAME@_deadlock(contact, 0);
        }
        c->speed[k] = c->held[k] > @ZERO@ ? @ZERO@ : c->speed[k];
        c->w[k] = c->speed[k] + bounce*e*@MIN@(c->speed[k], @ZERO@);
    }
    if (@NAME@_push(@U@, c) != 0) {
        return @NAME@_deadlock(contact, c);
    }
    for (k = 0; k < @U@; ++k) {
        contact[k] = c->active[k];
        /* The least rate after the impact, and that of active contacts. */
        c->speed[k] = -bounce*c->restitution[k]*@MIN@(c->speed[k], @ZERO@);
        (void)@NAME@_speed(k, y, c, &c->size[k]);
    }
    /* A second time for what rounding has left of the first. */
    for (round = 0; round < 2; ++round) {
        for (k = 0; k < @U@; ++k) {
            @REAL@ size;
            contact[@U@ + k] = c->speed[k] - @NAME@_speed(k, y, c, &size);
        }
        status = @NAME@_impulse(@PASSED@, work, c->change);
        if (status != 0) {
            return status;
        }
        for (i = 0; i < @N@; ++i) {
            y[@N@ + i] += c->change[i];
        }
    }
    for (k = 0; k < @U@; ++k) {
        @REAL@ size;
        const @REAL@ speed = @NAME@_speed(k, y, c, &size), off = speed - c->speed[k];
        const int active = c->active[k] > @ZERO@;
        c->size[k] += size;
        if (c->closed[k] > @ZERO@
            && !((active ? @FABS@(off) : -off) <= @LOOSER@*@TOLERANCE@*c->size[k])) {
            return @NAME@_deadlock(contact, 0);
        }
        c->speed[k] = active ? c->speed[k] : speed;
    }
    return 0;
}

/* The contacts among what is closed that have to push now. */
static int @NAME@_settle(@MUTABLE@, @REAL@ *work, @NAME@_closing *c)
{
@CHANGING@    int i, k, pushing = 0, status = @NAME@_gap_terms(@PASSED@, work, c->gradient);
    if (status == 0) {
        status = @NAME@_@FLIGHT@rhs(@FREE@, work, c->change);
    }
    if (status != 0) {
        return status;
    }
    for (k = 0; k < @U@; ++k) {
        c->w[k] = c->bias[k];
        c->size[k] = @FABS@(c->bias[k]);
        for (i = 0; i < @N@; ++i) {
            const @REAL@ term = c->gradient[k*@N@ + i]*c->change[@N@ + i];
            c->w[k] += term;
            c->size[k] += @FABS@(term);
        }
    }
    if (@NAME@_push(@U@, c) != 0) {
        return @NAME@_deadlock(contact, c);
    }
    for (k = 0; k < @U@; ++k) {
        contact[k] = c->active[k];
        contact[@U@ + k] = @ZERO@;
        pushing = pushing || contact[k] > @ZERO@;
    }
    return pushing ? @NAME@_contact_multipliers(@PASSED@, work, c->change) : 0;
}
"""

_RESET = """\
@STATIC@int @NAME@_@OF@reset(@MUTABLE_STATE@, @INT@ event, @REAL@ bounce, @REAL@ *work)
{
    @NAME@_closing c;
    int k, any = 0, approaching = 0, status;
    c.gap = work + @START@;
    c.gradient = c.gap + 2*@U@;
    c.rate = c.gradient + @U@*@N@;
    c.bias = c.rate + @U@;
    c.restitution = c.bias + @U@;
    c.held = c.restitution + @U@;
    c.closed = c.held + @U@;
    c.speed = c.closed + @U@;
    c.w = c.speed + @U@;
    c.size = c.w + @U@;
    c.x = c.size + @U@;
    c.active = c.x + @U@;
    c.d = c.active + @U@;
    c.change = c.d + @U@*@U@;
    c.more = c.change + @RESULTS@;
    status = @NAME@_look(@PASSED@, (int)event, work, &c);
    if (status == 0) {
        status = @NAME@_respond(@PASSED@, work, &c);
    }
    if (status != 0) {
        return status;
    }
    for (k = 0; k < @U@; ++k) {
        const int comes = c.held[k] == @ZERO@ && c.speed[k] < -@TOLERANCE@*c.size[k];
        any = any || c.closed[k] > @ZERO@;
        approaching = approaching || (c.closed[k] > @ZERO@ && comes);
    }
    if (approaching) {
        status = @NAME@_hit(@PASSED@, bounce, work, &c);
        if (status != 0) {
            return status;
        }
    }
    for (k = 0; k < @U@; ++k) {
        const int stays = c.speed[k] <= @TOLERANCE@*c.size[k]
            || (!approaching && c.held[k] > @ZERO@);
        const int released = !approaching && k == (int)event && c.held[k] > @ZERO@;
        c.closed[k] = stays && !released ? c.closed[k] : @ZERO@;
    }
    return @NAME@_settle(@PASSED@, work, &c);
}
"""


def reset_text(programs: Mapping[str, Program], target: CTarget) -> str:
    """``events`` and ``reset`` with what they need, empty where there are no contacts."""
    if "gaps" not in programs:
        return ""
    names, real = target.names, target.real
    own = programs["gaps"].parameters - 2 * _contacts(programs)
    given = _arguments(names, own) | {
        "@PASSED@": names.passed,
        "@ARGUMENTS@": target.arguments("out"),
        "@U@": str(_contacts(programs)),
        "@M@": str(_multipliers(programs) - _contacts(programs)),
        "@N@": str(programs["gaps"].coordinates),
        "@START@": str(_inner(programs)),
        "@RESULTS@": str(_results(programs)),
        **push_replacements(_contacts(programs), real),
        "@MIN@": f"fmin{real.suffix}",
        "@MAX@": f"fmax{real.suffix}",
        "@TOLERANCE@": real.value(max(RATE_TOLERANCE, 64 * float(real.epsilon))),
        "@LOOSER@": real.value(IMPACT_TOLERANCES),
        "@ULPS@": real.value(128 * float(real.epsilon)),
    }
    parts = [_EVENTS, _STRUCTURE, *push_templates(_contacts(programs)), _IMPACT, _RESET]
    return "\n".join(target.fill(target.fill(part, given)) for part in parts)


def _arguments(names: CNames, own: int) -> dict[str, str]:
    """Where functions find flags and targets: behind the parameters, or in their own array."""
    inside = names.contact_from is None
    constant = "" if inside else ", const @REAL@ *contact"
    changing = "" if inside else ", @REAL@ *contact"
    state = f"@REAL@ t, {{}}@REAL@ *y, const @REAL@ *u, {{}}{names.prefix}_params *p"
    changed = "" if inside else "const "
    return {
        "@OF@": "" if inside else "contact_",
        "@STATIC@": "" if inside else "static ",
        "@INT@": "long" if inside else "int",
        "@FLIGHT@": "" if inside else "flight_",
        "@FREE@": "t, y, u, p",
        "@STATE@": state.format("const ", "const ") + constant,
        "@MUTABLE@": state.format("const ", changed) + changing,
        "@MUTABLE_STATE@": state.format("", changed) + changing,
        "@CONTACT@": f"    const @REAL@ *const contact = p->p + {own};\n" if inside else "",
        "@CHANGING@": f"    @REAL@ *const contact = p->p + {own};\n" if inside else "",
    }


def reset_workspace(programs: Mapping[str, Program]) -> int:
    """Numbers of workspace for ``events`` and ``reset``, 0 where there are no contacts."""
    if "gaps" not in programs:
        return 0
    n, u = programs["gaps"].coordinates, _contacts(programs)
    events = max(2 * u, _multipliers(programs))
    known = 2 * u + u * (n + 3) + 7 * u + u * u + _results(programs)
    return _inner(programs) + max(events, known + u * u + 3 * u)


def _inner(programs: Mapping[str, Program]) -> int:
    """What the functions that are called need of it."""
    called = ("gaps", "gap_terms", "impulse", "contact_multipliers", "rhs", "flight_rhs")
    return max(work_size(programs[name]) for name in called if name in programs)


def _contacts(programs: Mapping[str, Program]) -> int:
    """Their number: each has a gap, and its magnitude."""
    return results_of(programs["gaps"]) // 2


def _multipliers(programs: Mapping[str, Program]) -> int:
    return sum(len(block.closures) for block in programs["contact_multipliers"].blocks)


def _results(programs: Mapping[str, Program]) -> int:
    """The most numbers that a called function gives, besides terms."""
    return max(2 * programs["gaps"].coordinates, _multipliers(programs))
