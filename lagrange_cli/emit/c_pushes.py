"""Templates of C that find which contacts push (see :mod:`lagrange_cli.emit.c_reset`)."""

from __future__ import annotations

from lagrange_cli.emit.c_names import Real
from lagrange_cli.emit.constants import PUSH_STEPS

__all__ = ["push_replacements", "push_templates"]

#: Contacts from which on those that push are guessed first.
FEWEST_GUESSED = 8

#: Rounds of guesses, and pivots (of a matrix with ones on the diagonal) that end them.
ROUNDS, SMALLEST = 12, 1e-6

_AMONG_ACTIVE = """\
/* more[0..n-1] becomes r of d r = more, for active pushes alone; what is zero costs nothing
 * (contacts that act on their neighbours). 1: a pivot is not larger than smallest, if that
 * is positive. */
static int @NAME@_among_active(int n, @REAL@ smallest, @NAME@_closing *c)
{
    @REAL@ *const r = c->more, *const a = r + n;
    int i, j, l;
    for (i = 0; i < n; ++i) {
        for (j = 0; j < n; ++j) {
            const int both = c->active[i] > @ZERO@ && c->active[j] > @ZERO@;
            a[i*n + j] = both ? c->d[i*n + j] : (i == j ? @ONE@ : @ZERO@);
        }
    }
    for (j = 0; j < n; ++j) {
        if (smallest > @ZERO@ && !(a[j*n + j] > smallest)) {
            return 1;
        }
        for (i = j + 1; i < n; ++i) {
            const @REAL@ ratio = a[i*n + j]/a[j*n + j];
            if (ratio < @ZERO@ || ratio > @ZERO@) {
                for (l = j; l < n; ++l) {
                    a[i*n + l] -= ratio*a[j*n + l];
                }
                r[i] -= ratio*r[j];
            }
        }
    }
    for (i = n - 1; i >= 0; --i) {
        for (j = i + 1; j < n; ++j) {
            r[i] -= a[i*n + j]*r[j];
        }
        r[i] /= a[i*n + i];
    }
    return 0;
}
"""

_GUESS = """\
/*
 * With many contacts, x and active of what pushes at first sight: all that is violated,
 * without what would pull, with what is violated then (Hintermueller, Ito and Kunisch,
 * SIAM J. Optim. 13 (2002) 865). Zeros where that does not end soon.
 */
static void @NAME@_guess(int n, const @REAL@ *w, const @REAL@ *size, @NAME@_closing *c)
{
    int j, k, round, changes = 1;
    for (k = 0; k < n; ++k) {
        c->active[k] = c->closed[k] > @ZERO@ && w[k] < @ZERO@ ? @ONE@ : @ZERO@;
    }
    for (round = 0; round < @ROUNDS@ && changes; ++round) {
        for (k = 0; k < n; ++k) {
            c->more[k] = c->active[k] > @ZERO@ ? -w[k] : @ZERO@;
        }
        if (@NAME@_among_active(n, @SMALLEST@, c) != 0) {
            break;
        }
        changes = 0;
        for (k = 0; k < n; ++k) {
            const int active = c->active[k] > @ZERO@;
            @REAL@ rate = w[k], magnitude = size[k];
            int pushes;
            for (j = 0; j < n; ++j) {
                rate += c->d[k*n + j]*c->more[j];
                magnitude += @FABS@(c->d[k*n + j]*c->more[j]);
            }
            pushes = active ? c->more[k] > @ZERO@
                : c->closed[k] > @ZERO@ && rate < -@TOLERANCE@*magnitude;
            changes = changes || pushes != active;
            c->x[k] = pushes ? @ONE@ : @ZERO@;
        }
        for (k = 0; k < n; ++k) {
            c->active[k] = changes ? c->x[k] : c->active[k];
            c->x[k] = c->more[k];
        }
    }
    for (k = 0; k < n && changes; ++k) {
        c->active[k] = c->x[k] = @ZERO@;
    }
}
"""

_PUSH = """\
/* more[0..n-1]: how active pushes give way to a unit of push k. */
static void @NAME@_giving_way(int n, int k, @NAME@_closing *c)
{
    int i;
    for (i = 0; i < n; ++i) {
        c->more[i] = c->active[i] > @ZERO@ ? c->d[i*n + k] : @ZERO@;
    }
    (void)@NAME@_among_active(n, @ZERO@, c);
}

/*
 * Raises push k until w[k] is zero; active pushes that are used up end. Returns 1 if it
 * has no effect; active are then those that take all of it.
 */
static int @NAME@_raise(int n, int k, @NAME@_closing *c)
{
    int j;
    for (;;) {
        const @REAL@ *const r = c->more;
        @REAL@ rise = c->d[k*n + k], least = @ZERO@, full;
        int first = -1;
        @NAME@_giving_way(n, k, c);
        for (j = 0; j < n; ++j) {
            if (c->active[j] > @ZERO@) {
                rise -= c->d[k*n + j]*r[j];
                if (r[j] > @ZERO@ && (first < 0 || c->x[j]/r[j] < least)) {
                    first = j;
                    least = c->x[j]/r[j];
                }
            }
        }
        full = rise > @TOLERANCE@ ? -c->w[k]/rise : INFINITY;
        if (first < 0 && !(full < INFINITY)) {
            for (j = 0; j < n; ++j) {
                c->active[j] = j == k || r[j] < -@TOLERANCE@ ? @ONE@ : @ZERO@;
            }
            return 1;
        }
        if (first < 0 || full <= least) {
            least = full;
            first = -1;
        }
        for (j = 0; j < n; ++j) {
            if (c->active[j] > @ZERO@) {
                c->x[j] = @MAX@(c->x[j] - least*r[j], @ZERO@);
            }
        }
        c->x[k] += least;
        if (first < 0) {
            c->active[k] = @ONE@;
            return 0;
        }
        c->w[k] = @MIN@(c->w[k] + least*rise, @ZERO@);
        c->active[first] = c->x[first] = @ZERO@;
    }
}

/*
 * Pushes x >= 0 with w + d x >= 0, one of both zero for each contact that is
 * closed, by the dual method of Goldfarb and Idnani (Math. Programming 27
 * (1983) 1). w and size become w + d x and its magnitudes; w is zero where it is
 * rounding. Returns 1 if there are no such pushes; active are then contacts that
 * cannot all be met, none where that is not known.
 */
static int @NAME@_push(int n, @NAME@_closing *c)
{
    @REAL@ *const w = c->more + n + n*n, *const size = w + n;
    int j, k, step;
    for (k = 0; k < n; ++k) {
        c->x[k] = c->active[k] = @ZERO@;
        w[k] = @FABS@(c->w[k]) > @TOLERANCE@*c->size[k] ? c->w[k] : @ZERO@;
        size[k] = c->size[k];
    }
@GUESSED@    for (step = 0; step < @STEPS@*(n + 1); ++step) {
        int violated = -1;
        for (k = n - 1; k >= 0; --k) {
            c->w[k] = w[k];
            c->size[k] = size[k];
            for (j = 0; j < n; ++j) {
                c->w[k] += c->d[k*n + j]*c->x[j];
                c->size[k] += @FABS@(c->d[k*n + j]*c->x[j]);
            }
            if (c->active[k] > @ZERO@ || @FABS@(c->w[k]) <= @TOLERANCE@*c->size[k]) {
                c->w[k] = @ZERO@;
            }
            violated = c->closed[k] > @ZERO@ && c->w[k] < @ZERO@ ? k : violated;
        }
        if (violated < 0) {
            return 0;
        }
        if (@NAME@_raise(n, violated, c) != 0) {
            return 1;
        }
    }
    for (k = 0; k < n; ++k) {
        c->active[k] = @ZERO@;
    }
    return 1;
}

/* contact: those that leave no motion behind an event, which is the error 4. */
static int @NAME@_deadlock(@REAL@ *contact, const @NAME@_closing *c)
{
    int k;
    for (k = 0; k < @U@; ++k) {
        contact[k] = c != 0 ? c->active[k] : @ZERO@;
    }
    return 4;
}
"""


def push_templates(contacts: int) -> list[str]:
    """The functions, in their order."""
    guess = [_GUESS] if contacts >= FEWEST_GUESSED else []
    return [_AMONG_ACTIVE, *guess, _PUSH]


def push_replacements(contacts: int, real: Real) -> dict[str, str]:
    """What stands for their tokens."""
    many = contacts >= FEWEST_GUESSED
    return {
        "@STEPS@": str(PUSH_STEPS),
        "@ROUNDS@": str(ROUNDS),
        "@SMALLEST@": real.value(max(SMALLEST, 64 * float(real.epsilon))),
        "@GUESSED@": "    @NAME@_guess(n, w, size, c);\n" if many else "",
    }
