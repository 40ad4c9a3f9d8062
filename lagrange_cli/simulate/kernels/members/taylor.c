/* Many motions stepped side by side by their Taylor series, one a lane.
 *
 * Jorba, Zou, Experiment. Math. 14 (2005) 99: the step follows from the last two coefficients,
 * and nothing is rejected. Each lane has its own time and step; when its motion is complete the
 * next one takes the lane. States are kept as hi + low, so that rounding does not add up.
 */
#include "taylor.h"

#define W LAGRANGE_WIDTH

typedef lagrange_lane lane;

/* The runs of some members, by one right-hand side. The caller sets everything above `begun`;
 * the rest, and `memory`, are zeros at first. A state has n numbers, coordinates first. */
typedef struct {
    lagrange_series series;
    const double *times;   /* of the samples; the first is the start */
    const double *starts;  /* members x n */
    const double *p;       /* members x parameters */
    const int64_t *kinds;  /* of each coordinate: 0 for an angle, else from 1 on */
    double *states;        /* members x samples x n, of which `filled` are filled */
    int64_t *filled;
    int64_t *steps;
    void *memory;          /* as much as lagrange_taylor_memory says, aligned as vectors are */
    int64_t n, rows, order, members, samples, parameters, most_steps;
    double tolerance, longest;
    double glance;         /* slopes are looked at within a step this far apart, 0: nowhere, */
    double forgiven;       /* and may be off by so much over a step, beside the scales */
    int64_t begun;         /* members that have got a lane */
    int64_t member[W];     /* in each lane, -1 for none */
    int64_t next[W];       /* its next sample */
} lagrange_members;

#ifdef LAGRANGE_DIM
#define DIM(m) LAGRANGE_DIM
#else
#define DIM(m) ((m)->n)
#endif

/* A coordinate that moves less than this part of the largest of its kind is measured by that
 * one; what scales so far count beside the present size; a first scale is what the start
 * moves in this part of the span. */
static const double SMALL = 1e-3, SO_FAR = 0.1, AT_FIRST = 1e-8, LEAST = 1e-290;

/* Rows of lanes in the memory. */
static lane *hi(const lagrange_members *m)
{
    return m->memory;
}

static lane *low(const lagrange_members *m)
{
    return hi(m) + DIM(m);
}

/* The start, and how far each number has been: coordinates from there, velocities from 0. */
static lane *start(const lagrange_members *m)
{
    return hi(m) + 2*DIM(m);
}

static lane *moved(const lagrange_members *m)
{
    return hi(m) + 3*DIM(m);
}

/* Units of errors, then states between steps. */
static lane *scale(const lagrange_members *m)
{
    return hi(m) + 4*DIM(m);
}

static lane *slope_of(const lagrange_members *m)
{
    return hi(m) + 5*DIM(m);
}

static lane *time_of(const lagrange_members *m)
{
    return hi(m) + 6*DIM(m);
}

static lane *parameters_of(const lagrange_members *m)
{
    return time_of(m) + 1;
}

static lane *coefficients(const lagrange_members *m)
{
    return parameters_of(m) + m->parameters;
}

/* Rows of two coefficients, for the slope at one state. */
static lane *within(const lagrange_members *m)
{
    return coefficients(m) + m->rows*(m->order + 1);
}

int64_t lagrange_taylor_memory(const lagrange_members *m)
{
    return (int64_t)sizeof(lane)*(6*m->n + 1 + m->parameters + m->rows*(m->order + 3));
}

/* Binary digits of the numbers that this is compiled for. */
int64_t lagrange_taylor_digits(void)
{
    volatile double sum = 2.0, part = 1.0;
    int64_t digits = 0;
    for (; sum != 1.0; part /= 2.0) {
        sum = 1.0 + part;
        digits += 1;
    }
    return digits - 1;
}

int64_t lagrange_taylor_width(void)
{
    return W;
}

/* Give a lane to the next member, or to none. */
static void take_in(lagrange_members *m, int l)
{
    const int64_t n = DIM(m), member = m->begun;
    int64_t i;
    if (member == m->members) {
        m->member[l] = -1;
        return;
    }
    m->begun += 1;
    m->member[l] = member;
    m->next[l] = 1;
    m->filled[member] = 1;
    m->steps[member] = 0;
    LANE(*time_of(m), l) = m->times[0];
    for (i = 0; i < n; ++i) {
        const double x = m->starts[member*n + i];
        LANE(start(m)[i], l) = LANE(hi(m)[i], l) = x;
        LANE(low(m)[i], l) = 0.0;
        LANE(moved(m)[i], l) = i < n/2 ? 0.0 : fabs(x);
        m->states[member*m->samples*n + i] = x;
    }
    for (i = 0; i < m->parameters; ++i) {
        LANE(parameters_of(m)[i], l) = m->p[member*m->parameters + i];
    }
}

/* A time in which the start moves as it begins: no longer than AT_FIRST of the span, nor than
 * coefficients tell to be short (a comet at its perihelion). */
static lane beginning(const lagrange_members *m)
{
    const int64_t n = DIM(m), row = m->rows;
    const lane *const c = coefficients(m);
    lane h = {0.0};
    int64_t i, k;
    h += AT_FIRST*(m->times[m->samples - 1] - m->times[0]);
    for (k = 1; k < 3; ++k) {
        for (i = 0; i < n; ++i) {
            const lane ratio = lagrange_size(c[k*row + i])/lagrange_size(c[(k + 2)*row + i]);
            h = lagrange_smaller(lagrange_each_sqrt(lagrange_unless_zero(ratio, h*h)), h);
        }
    }
    return h;
}

/* Scales of the motion so far, as far as the tolerance follows them. */
static void measure(const lagrange_members *m)
{
    const int64_t n = DIM(m), half = n/2, row = m->rows;
    const double span = m->times[m->samples - 1] - m->times[0];
    const lane *const c = coefficients(m);
    const lane h = beginning(m);
    lane *const s = scale(m);
    int64_t i, j;
    for (i = 0; i < n; ++i) {
        const lane at_first = lagrange_size(c[row + i])*h + lagrange_size(c[2*row + i])*(h*h);
        s[i] = lagrange_unless_zero(moved(m)[i], at_first);
    }
    for (i = 0; i < half; ++i) {
        lane largest = s[i];
        for (j = 0; j < half; ++j) {
            largest = m->kinds[j] == m->kinds[i] ? lagrange_larger(largest, SMALL*s[j]) : largest;
        }
        s[half + i] = lagrange_larger(s[half + i], largest*(1.0/span));
    }
    for (i = 0; i < half; ++i) {
        const lane speed = lagrange_larger(SO_FAR*s[half + i], lagrange_size(hi(m)[half + i]));
        const lane place = lagrange_smaller(s[i], lagrange_size(hi(m)[i]));
        s[i] = lagrange_larger(SO_FAR*s[i], place);
        if (m->kinds[i] == 0) {
            s[i] = (lane){0.0} + 1.0;
        }
        s[i] = m->tolerance*s[i] + LEAST;
        s[half + i] = m->tolerance*speed + LEAST;
    }
}

/* The step at whose end neither of the last two coefficients is larger than the tolerance. */
static lane step_of(const lagrange_members *m)
{
    const int64_t n = DIM(m), row = m->rows, k = m->order;
    const lane *const c = coefficients(m) + k*row;
    lane last = {0.0}, before = {0.0};
    int64_t i;
    for (i = 0; i < n; ++i) {
        const lane weight = 1.0/scale(m)[i];
        last = lagrange_larger(lagrange_size(c[i])*weight, last);
        before = lagrange_larger(lagrange_size(c[i - row])*weight, before);
    }
    last = lagrange_logarithm(last)*(-1.0/(double)k);
    before = lagrange_logarithm(before)*(-1.0/(double)(k - 1));
    return lagrange_power_of_two(lagrange_smaller(last, before));
}

/* The states x after the beginning of the step, without the beginning itself. */
static void change(const lagrange_members *m, lane x, lane *out)
{
    const int64_t n = DIM(m), row = m->rows;
    int64_t i, k;
    for (i = 0; i < n; ++i) {
        const lane *const c = coefficients(m) + i;
        lane sum = c[m->order*row];
        for (k = m->order - 1; k > 0; --k) {
            sum = sum*x + c[k*row];
        }
        out[i] = sum*x;
    }
}

/* Fill the samples up to the ends of the steps. */
static void sample(lagrange_members *m, const lane *end)
{
    const int64_t n = DIM(m), samples = m->samples;
    lane *const states = scale(m);
    for (;;) {
        int64_t pending[W];
        lane x = {0.0};
        int64_t i;
        int l, any = 0;
        for (l = 0; l < W; ++l) {
            pending[l] = m->member[l] >= 0 && m->next[l] < samples
                         && m->times[m->next[l]] <= LANE(*end, l);
            LANE(x, l) = pending[l] ? m->times[m->next[l]] - LANE(*time_of(m), l) : 0.0;
            any |= (int)pending[l];
        }
        if (!any) {
            return;
        }
        change(m, x, states);
        for (i = 0; i < n; ++i) {
            states[i] = hi(m)[i] + (low(m)[i] + states[i]);
        }
        for (l = 0; l < W; ++l) {
            if (pending[l]) {
                double *const out = m->states + (m->member[l]*samples + m->next[l])*n;
                for (i = 0; i < n; ++i) {
                    out[i] = LANE(states[i], l);
                }
                m->next[l] += 1;
            }
        }
    }
}

/* Not a number in lanes whose slopes within the step are not those of the series: something has
 * happened that the coefficients at its beginning do not show. */
static lane look(const lagrange_members *m, lane h)
{
    const int64_t n = DIM(m), row = m->rows;
    const lane *const c = coefficients(m);
    lane *const at = within(m);
    lane bad = {0.0};
    double counts[W], most = 0.0, count;
    int64_t i, k;
    int l;
    for (l = 0; l < W; ++l) {
        counts[l] = m->glance > 0.0 ? floor(LANE(h, l)/m->glance) : 0.0;
        most = m->member[l] >= 0 && counts[l] > most ? counts[l] : most;
    }
    for (count = 1.0; count <= most; count += 1.0) {
        lane x;
        for (l = 0; l < W; ++l) {
            LANE(x, l) = count <= counts[l] ? LANE(h, l)*(count/(1.0 + counts[l])) : 0.0;
        }
        for (i = 0; i < n; ++i) {
            lane sum = c[m->order*row + i], slope = (lane){0.0};
            for (k = m->order - 1; k >= 0; --k) {
                slope = slope*x + sum;
                sum = sum*x + c[k*row + i];
            }
            at[i] = sum;
            slope_of(m)[i] = slope;
        }
        at[n] = *time_of(m) + x;
        at[row + n] = (lane){0.0} + 1.0;
        m->series(1, parameters_of(m), at);
        for (i = 0; i < n; ++i) {
            const lane off = lagrange_size(at[row + i] - slope_of(m)[i])*h;
            const lane moves = lagrange_size(slope_of(m)[i])*h;
            const lane allowed = m->forgiven*(scale(m)[i]*(1.0/m->tolerance) + moves);
            bad += lagrange_require_above(allowed, off);
        }
    }
    return bad;
}

/* Move to the end of the step (Knuth's exact sum); what is no number where one is not finite. */
static lane move(const lagrange_members *m, const lane *by)
{
    const int64_t n = DIM(m);
    lane bad = {0.0};
    int64_t i;
    for (i = 0; i < n; ++i) {
        const lane x = hi(m)[i], rest = low(m)[i] + by[i];
        const lane sum = x + rest, part = sum - x;
        low(m)[i] = (x - (sum - part)) + (rest - part);
        hi(m)[i] = sum;
        bad += 0.0*sum;
        moved(m)[i] = lagrange_larger(moved(m)[i], lagrange_size(i < n/2 ? sum - start(m)[i] : sum));
    }
    return bad;
}

/* One step in each lane. */
static void round_of(lagrange_members *m)
{
    const int64_t n = DIM(m), row = m->rows;
    const double last = m->times[m->samples - 1];
    lane *const c = coefficients(m), *const t = time_of(m);
    lane h, end, bad;
    int64_t i;
    int l;
    for (i = 0; i < n; ++i) {
        c[i] = hi(m)[i];
    }
    c[n] = *t;
    c[row + n] = (lane){0.0} + 1.0;
    m->series((int)m->order, parameters_of(m), c);
    measure(m);
    h = lagrange_smaller(step_of(m), (lane){0.0} + m->longest);
    end = lagrange_smaller(*t + h, (lane){0.0} + last);
    h = end - *t;
    bad = look(m, h);
    sample(m, &end);
    change(m, h, scale(m));
    bad += move(m, scale(m));
    for (l = 0; l < W; ++l) {
        const int64_t member = m->member[l];
        if (member >= 0) {
            const int good = LANE(bad, l) == 0.0 && LANE(h, l) > 0.0;
            m->steps[member] += 1;
            if (good) {
                m->filled[member] = m->next[l];
            }
            if (!good || m->next[l] == m->samples || m->steps[member] == m->most_steps) {
                take_in(m, l);
            } else {
                LANE(*t, l) = LANE(end, l);
            }
        }
    }
}

/* Go on for so many steps in each lane; 0 once all members have ended. Those whose samples are
 * not all filled have failed. */
int lagrange_taylor_advance(lagrange_members *m, int64_t most)
{
    int64_t k;
    int l, any;
    for (l = 0; l < W && m->begun == 0; ++l) {
        m->member[l] = -1;
    }
    for (l = 0; l < W; ++l) {
        if (m->member[l] < 0 && m->begun < m->members) {
            take_in(m, l);
        }
    }
    for (k = 0; k < most; ++k) {
        for (l = any = 0; l < W; ++l) {
            any |= m->member[l] >= 0;
        }
        if (!any) {
            return 0;
        }
        round_of(m);
    }
    return 1;
}
