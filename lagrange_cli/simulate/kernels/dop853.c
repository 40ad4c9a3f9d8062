/* Dormand and Prince's method of order 8 with estimates of orders 5 and 3.
 *
 * Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.5 and
 * II.6; step control as SciPy's DOP853 has it. The state is kept as hi + low,
 * so that rounding does not add up from step to step.
 */
#include "kernel.h"

/* Rows of the memory: slopes K(0) to K(15), coefficients of the interpolant,
 * the point of a stage and the weights of the estimates. */
enum { SLOPES = FIRST_OF_METHOD, SHAPE = SLOPES + 16, POINT = SHAPE + 7, SCALE, ROWS };

#define K(j) k[(j)*n + i]

/* Slope j at t_old + c h, from the start of the step plus h times a sum of slopes. */
#define STAGE(j, c, sum)                                                     \
    for (i = 0; i < n; ++i) {                                                \
        point[i] = hi[i] + (low[i] + h*(sum));                               \
    }                                                                        \
    if (lagrange_slope(run, t + (c)*h, point, SLOPES + (j))) {               \
        return 1;                                                            \
    }

/* The slopes of the step. */
#define SLOPES_OF(run)                                                       \
    const int64_t n = DIM(run);                                              \
    const double *const k = lagrange_row(run, SLOPES);                       \
    int64_t i

/* The same with where it starts, beside its state. */
#define STEP_OF(run)                                                         \
    SLOPES_OF(run);                                                          \
    const double *const low = lagrange_row(run, START_LOW)

/* The same with its state, and memory for another one. */
#define STATE_OF(run)                                                        \
    STEP_OF(run);                                                            \
    const double *const hi = lagrange_row(run, START_HI);                    \
    double *const point = lagrange_row(run, POINT)

/* True if nothing moves: then neither does it later in the step, unless something depends on t,
 * which `mode` tells. */
static int rests(const lagrange_run *run)
{
    double *const all = lagrange_row(run, SLOPES);
    int64_t j;
    SLOPES_OF(run);
    for (i = 0; i < n; ++i) {
        if (!run->mode || K(0) != 0.0) {
            return 0;
        }
    }
    for (j = 1; j < 12; ++j) {
        for (i = 0; i < n; ++i) {
            all[j*n + i] = 0.0;
        }
    }
    return 1;
}

/* Slopes 1 to 11; not 0 where one does not exist. */
static int stages(lagrange_run *run, double t, double h)
{
    STATE_OF(run);
    if (rests(run)) {
        return 0;
    }
    STAGE(1, R(0.526001519587677318785587544488e-01),
        R(5.26001519587677318785587544488e-2)*K(0));
    STAGE(2, R(0.789002279381515978178381316732e-01),
        R(1.97250569845378994544595329183e-2)*K(0) + R(5.91751709536136983633785987549e-2)*K(1));
    STAGE(3, R(0.118350341907227396726757197510),
        R(2.95875854768068491816892993775e-2)*K(0) + R(8.87627564304205475450678981324e-2)*K(2));
    STAGE(4, R(0.281649658092772603273242802490),
        R(2.41365134159266685502369798665e-1)*K(0) - R(8.84549479328286085344864962717e-1)*K(2)
        + R(9.24834003261792003115737966543e-1)*K(3));
    STAGE(5, R(0.333333333333333333333333333333),
        R(3.7037037037037037037037037037e-2)*K(0) + R(1.70828608729473871279604482173e-1)*K(3)
        + R(1.25467687566822425016691814123e-1)*K(4));
    STAGE(6, 0.25,
        3.7109375e-2*K(0) + R(1.70252211019544039314978060272e-1)*K(3)
        + R(6.02165389804559606850219397283e-2)*K(4) - 1.7578125e-2*K(5));
    STAGE(7, R(0.307692307692307692307692307692),
        R(3.70920001185047927108779319836e-2)*K(0) + R(1.70383925712239993810214054705e-1)*K(3)
        + R(1.07262030446373284651809199168e-1)*K(4)
        - R(1.53194377486244017527936158236e-2)*K(5)
        + R(8.27378916381402288758473766002e-3)*K(6));
    STAGE(8, R(0.651282051282051282051282051282),
        R(6.24110958716075717114429577812e-1)*K(0) - R(3.36089262944694129406857109825)*K(3)
        - R(8.68219346841726006818189891453e-1)*K(4) + R(2.75920996994467083049415600797e1)*K(5)
        + R(2.01540675504778934086186788979e1)*K(6) - R(4.34898841810699588477366255144e1)*K(7));
    STAGE(9, R(0.6),
        R(4.77662536438264365890433908527e-1)*K(0) - R(2.48811461997166764192642586468)*K(3)
        - R(5.90290826836842996371446475743e-1)*K(4) + R(2.12300514481811942347288949897e1)*K(5)
        + R(1.52792336328824235832596922938e1)*K(6) - R(3.32882109689848629194453265587e1)*K(7)
        - R(2.03312017085086261358222928593e-2)*K(8));
    STAGE(10, R(0.857142857142857142857142857142),
        -R(9.3714243008598732571704021658e-1)*K(0) + R(5.18637242884406370830023853209)*K(3)
        + R(1.09143734899672957818500254654)*K(4) - R(8.14978701074692612513997267357)*K(5)
        - R(1.85200656599969598641566180701e1)*K(6) + R(2.27394870993505042818970056734e1)*K(7)
        + R(2.49360555267965238987089396762)*K(8) - R(3.0467644718982195003823669022)*K(9));
    STAGE(11, 1.0,
        R(2.27331014751653820792359768449)*K(0) - R(1.05344954667372501984066689879e1)*K(3)
        - R(2.00087205822486249909675718444)*K(4) - R(1.79589318631187989172765950534e1)*K(5)
        + R(2.79488845294199600508499808837e1)*K(6) - R(2.85899827713502369474065508674)*K(7)
        - R(8.87285693353062954433549289258)*K(8) + R(1.23605671757943030647266201528e1)*K(9)
        + R(6.43392746015763530355970484046e-1)*K(10));
    return 0;
}

/* Slopes 13 to 15, for the interpolant alone. */
static int more_stages(lagrange_run *run, double t, double h)
{
    STATE_OF(run);
    STAGE(13, R(0.1),
        R(5.61675022830479523392909219681e-2)*K(0) + R(2.53500210216624811088794765333e-1)*K(6)
        - R(2.46239037470802489917441475441e-1)*K(7)
        - R(1.24191423263816360469010140626e-1)*K(8) + R(1.5329179827876569731206322685e-1)*K(9)
        + R(8.20105229563468988491666602057e-3)*K(10)
        + R(7.56789766054569976138603589584e-3)*K(11) - R(8.298e-3)*K(12));
    STAGE(14, R(0.2),
        R(3.18346481635021405060768473261e-2)*K(0) + R(2.83009096723667755288322961402e-2)*K(5)
        + R(5.35419883074385676223797384372e-2)*K(6)
        - R(5.49237485713909884646569340306e-2)*K(7)
        - R(1.08347328697249322858509316994e-4)*K(10)
        + R(3.82571090835658412954920192323e-4)*K(11)
        - R(3.40465008687404560802977114492e-4)*K(12)
        + R(1.41312443674632500278074618366e-1)*K(13));
    STAGE(15, R(0.777777777777777777777777777778),
        -R(4.28896301583791923408573538692e-1)*K(0) - R(4.69762141536116384314449447206)*K(5)
        + R(7.68342119606259904184240953878)*K(6) + R(4.06898981839711007970213554331)*K(7)
        + R(3.56727187455281109270669543021e-1)*K(8)
        - R(1.39902416515901462129418009734e-3)*K(12) + R(2.9475147891527723389556272149)*K(13)
        - R(9.15095847217987001081870187138)*K(14));
    return 0;
}

static double square(double x)
{
    return x*x;
}

/* The end of the step into POINT and LOW, and the error beside the tolerance;
 * not a number where the state is not finite. */
static double finish(lagrange_run *run, double h)
{
    STATE_OF(run);
    const double *const scale = lagrange_row(run, SCALE);
    double *const end = lagrange_row(run, LOW);
    double fifth = 0.0, third = 0.0, zero = 0.0, both;
    for (i = 0; i < n; ++i) {
        const double sum =
            R(5.42937341165687622380535766363e-2)*K(0) + R(4.45031289275240888144113950566)*K(5)
            + R(1.89151789931450038304281599044)*K(6) - R(5.8012039600105847814672114227)*K(7)
            + R(3.1116436695781989440891606237e-1)*K(8) - R(1.52160949662516078556178806805e-1)*K(9)
            + R(2.01365400804030348374776537501e-1)*K(10)
            + R(4.47106157277725905176885569043e-2)*K(11);
        const double e5 =
            R(0.1312004499419488073250102996e-1)*K(0) - R(0.1225156446376204440720569753e+1)*K(5)
            - R(0.4957589496572501915214079952)*K(6) + R(0.1664377182454986536961530415e+1)*K(7)
            - R(0.3503288487499736816886487290)*K(8) + R(0.3341791187130174790297318841)*K(9)
            + R(0.8192320648511571246570742613e-1)*K(10)
            - R(0.2235530786388629525884427845e-1)*K(11);
        const double e3 = sum - (R(0.244094488188976377952755905512)*K(0)
            + R(0.733846688281611857341361741547)*K(8) + R(0.220588235294117647058823529412e-1)*K(11));
        end[i] = low[i] + h*sum;
        point[i] = hi[i] + end[i];
        fifth += square(e5*scale[i]);
        third += square(e3*scale[i]);
        zero += 0.0*point[i];
    }
    both = (fifth + R(0.01)*third)*(double)n;
    return (both == 0.0 ? 0.0 : h*fifth/sqrt(both)) + zero;
}

/* error^(-1/8), the factor by which a step may change. */
static double factor(double error)
{
    return R(0.9)/sqrt(sqrt(sqrt(error)));
}

/* Move the end of the step onto the constraints, and the slope there: that of the next step's
 * start and of the interpolant's end. Not 0 where it does not exist. */
static int settle(lagrange_run *run, double t)
{
    double *const point = lagrange_row(run, POINT);
    return lagrange_project(run, t, lagrange_row(run, START_HI), lagrange_row(run, LOW), point) ||
           lagrange_slope(run, t, point, SLOPES + 12);
}

static void begin(lagrange_run *run)
{
    const int64_t n = DIM(run);
    double *const k = lagrange_row(run, SLOPES);
    int64_t i;
    lagrange_depart(run, SCALE);
    for (i = 0; i < n; ++i) {
        K(0) = K(12);
    }
    run->dense = 0;
}

static int step(lagrange_run *run, double limit)
{
    const double t = run->t, smallest = 10.0*(nextafter(t, HUGE_VAL) - t);
    double h = fmax(fmin(run->h, run->max_step), smallest), grow = 10.0;
    begin(run);
    for (;;) {
        double t_new, error;
        if (!(h >= smallest)) {
            return lagrange_stay(run, LAGRANGE_UNDERFLOW);
        }
        t_new = fmin(t + h, limit);
        h = t_new - t;
        error = stages(run, t, h) ? NAN : finish(run, h);
        if (error < 1.0 && !settle(run, t_new)) {
            run->h = h*(error > 0.0 ? fmin(grow, factor(error)) : grow);
            return lagrange_reach(run, t_new);
        }
        h *= error >= 1.0 ? fmax(R(0.2), factor(error)) : R(0.2);
        grow = 1.0;
        run->rejections += 1;
    }
}

/* True if slopes change linearly within the step, but for next to nothing beside the tolerance:
 * then the cubic through both ends with their slopes is the interpolant. */
static int straight(const lagrange_run *run, double h)
{
    const double at[] = {
        0.0, R(0.526001519587677318785587544488e-01), R(0.789002279381515978178381316732e-01),
        R(0.118350341907227396726757197510), R(0.281649658092772603273242802490), 1.0/3.0, 0.25, 4.0/13.0,
        R(0.651282051282051282051282051282), R(0.6), 6.0/7.0, 1.0};
    const double *const scale = lagrange_row(run, SCALE);
    int64_t j;
    SLOPES_OF(run);
    for (j = 1; j < 12; ++j) {
        for (i = 0; i < n; ++i) {
            const double off = K(j) - (K(0) + at[j]*(K(12) - K(0)));
            if (!(fabs(h*off*scale[i]) < R(0.3))) {
                return 0;
            }
        }
    }
    return 1;
}

/* The first coefficients of the interpolant, which goes through both ends with their slopes. */
static void prepare_ends(lagrange_run *run, double h)
{
    STEP_OF(run);
    const double *const end = lagrange_row(run, LOW);
    double *const shape = lagrange_row(run, SHAPE);
    for (i = 0; i < n; ++i) {
        const double change = end[i] - low[i];
        shape[i] = change;
        shape[n + i] = h*K(0) - change;
        shape[2*n + i] = 2.0*change - h*(K(12) + K(0));
        shape[3*n + i] = shape[4*n + i] = shape[5*n + i] = shape[6*n + i] = 0.0;
    }
}

/* Coefficients of the interpolant of order 7, from three more slopes. */
static int prepare(lagrange_run *run)
{
    SLOPES_OF(run);
    double *const shape = lagrange_row(run, SHAPE);
    const double h = run->t_new - run->t_old;
    prepare_ends(run, h);
    run->dense = straight(run, h);
    if (run->dense) {
        return 0;
    }
    if (more_stages(run, run->t_old, h)) {
        return 1;
    }
    for (i = 0; i < n; ++i) {
        shape[3*n + i] = h*(
            -R(0.84289382761090128651353491142e+1)*K(0) + R(0.56671495351937776962531783590)*K(5)
            - R(0.30689499459498916912797304727e+1)*K(6)
            + R(0.23846676565120698287728149680e+1)*K(7)
            + R(0.21170345824450282767155149946e+1)*K(8) - R(0.87139158377797299206789907490)*K(9)
            + R(0.22404374302607882758541771650e+1)*K(10) + R(0.63157877876946881815570249290)*K(11)
            - R(0.88990336451333310820698117400e-1)*K(12)
            + R(0.18148505520854727256656404962e+2)*K(13)
            - R(0.91946323924783554000451984436e+1)*K(14)
            - R(0.44360363875948939664310572000e+1)*K(15));
        shape[4*n + i] = h*(
            R(0.10427508642579134603413151009e+2)*K(0) + R(0.24228349177525818288430175319e+3)*K(5)
            + R(0.16520045171727028198505394887e+3)*K(6)
            - R(0.37454675472269020279518312152e+3)*K(7)
            - R(0.22113666853125306036270938578e+2)*K(8)
            + R(0.77334326684722638389603898808e+1)*K(9)
            - R(0.30674084731089398182061213626e+2)*K(10)
            - R(0.93321305264302278729567221706e+1)*K(11)
            + R(0.15697238121770843886131091075e+2)*K(12)
            - R(0.31139403219565177677282850411e+2)*K(13)
            - R(0.93529243588444783865713862664e+1)*K(14)
            + R(0.35816841486394083752465898540e+2)*K(15));
        shape[5*n + i] = h*(
            R(0.19985053242002433820987653617e+2)*K(0) - R(0.38703730874935176555105901742e+3)*K(5)
            - R(0.18917813819516756882830838328e+3)*K(6)
            + R(0.52780815920542364900561016686e+3)*K(7)
            - R(0.11573902539959630126141871134e+2)*K(8)
            + R(0.68812326946963000169666922661e+1)*K(9)
            - R(0.10006050966910838403183860980e+1)*K(10) + R(0.77771377980534432092869265740)*K(11)
            - R(0.27782057523535084065932004339e+1)*K(12)
            - R(0.60196695231264120758267380846e+2)*K(13)
            + R(0.84320405506677161018159903784e+2)*K(14)
            + R(0.11992291136182789328035130030e+2)*K(15));
        shape[6*n + i] = h*(
            -R(0.25693933462703749003312586129e+2)*K(0) - R(0.15418974869023643374053993627e+3)*K(5)
            - R(0.23152937917604549567536039109e+3)*K(6)
            + R(0.35763911791061412378285349910e+3)*K(7)
            + R(0.93405324183624310003907691704e+2)*K(8)
            - R(0.37458323136451633156875139351e+2)*K(9)
            + R(0.10409964950896230045147246184e+3)*K(10)
            + R(0.29840293426660503123344363579e+2)*K(11)
            - R(0.43533456590011143754432175058e+2)*K(12)
            + R(0.96324553959188282948394950600e+2)*K(13)
            - R(0.39177261675615439165231486172e+2)*K(14)
            - R(0.14972683625798562581422125276e+3)*K(15));
    }
    run->dense = 1;
    return 0;
}

static int interpolate(lagrange_run *run, double t, double *out)
{
    const int64_t n = DIM(run);
    const double *const hi = lagrange_row(run, START_HI);
    const double *const low = lagrange_row(run, START_LOW);
    const double *const shape = lagrange_row(run, SHAPE);
    const double x = (t - run->t_old)/(run->t_new - run->t_old), rest = 1.0 - x;
    int64_t i;
    if (!run->dense && prepare(run)) {
        return 1;
    }
    for (i = 0; i < n; ++i) {
        const double inner = (shape[5*n + i] + shape[6*n + i]*x)*rest;
        const double middle = (shape[3*n + i] + (shape[4*n + i] + inner)*x)*rest;
        const double outer = (shape[n + i] + (shape[2*n + i] + middle)*x)*rest;
        out[i] = hi[i] + (low[i] + (shape[i] + outer)*x);
    }
    return 0;
}

/* Stand at (t, hi + low); not 0 where the right-hand side does not exist there. */
static int stand(lagrange_run *run)
{
    return lagrange_slope(run, run->t, lagrange_row(run, HI), SLOPES + 12);
}

LAGRANGE_INTERPOLATING_METHOD(dop853, stand, step, interpolate)
