/* Event functions g(t, y) whose zeros are looked for within steps. */
#ifndef LAGRANGE_EVENTS_H
#define LAGRANGE_EVENTS_H

#include "kernel.h"

/* Intervals of a step at whose ends signs are looked at. */
#define LAGRANGE_PARTS 4

/* The sign of a function that is zero where the run begins, and then positive: its sign counts
 * from where it exceeds its noise. */
#define LAGRANGE_RISES 2.0

/* The caller sets everything; `sign` is 0 at first if it is not known. The caller takes the events
 * that were located and sets `located` back to 0. */
typedef struct lagrange_events {
    lagrange_function function; /* all count values of g at once */
    const double *u;
    const void *p;
    double *work;
    const int64_t *direction; /* 1 rising, -1 falling, 0 both */
    const int64_t *terminal;
    double *sign;   /* count: of each g when it was last not 0 */
    const double *noise; /* count: of each g where it rises from 0 */
    const double *reach; /* count: a positive g that dips no lower than zero is told below this */
    double *before; /* count: the signs before the last step */
    double *values; /* (LAGRANGE_PARTS + 4) rows of count */
    double *state;  /* n */
    int64_t count;
    int64_t capacity;
    int64_t located;
    int64_t first; /* where those of the last step begin */
    double *times; /* of the located ones, ascending */
    int64_t *indices; /* count and more: of a g that has a least value there, above zero */
    double *states;
} lagrange_events;

#endif
