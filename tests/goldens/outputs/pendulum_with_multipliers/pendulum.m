function varargout = pendulum(varargin)
% pendulum: Simple pendulum
%
% A point mass on a massless rod, swinging in a vertical plane, released at rest. The angle is 2
% asin(k cd(sqrt(g/l) t, k)) with k = sin(theta0/2), cd = cn/dn Jacobi's function; the period is 4
% sqrt(l/g) K(k). L. D. Landau and E. M. Lifshitz, Mechanics (3rd ed., 1976), section 11, problem 1.
%
% Equations of motion M(q, t) a = f(q, v, t) + sum of l[k]*g[k], with closures beside
% them: l[k] is the multiplier and g[k] the gradient of closure k.
% The state y holds the coordinates q, then their velocities v. Functions have no result
% (NaN, or a status that is not 0) where M is singular or a number is not finite.
%
% Coordinates, in their order:
%   x
%   z
%
% Parameters, in their order:
%   m [kg]: mass of the bob
%   l [m]: length of the rod
%   g [m/s^2]: gravitational acceleration
%
% Positions, in their order:
%   y
%
% Closures, in their order:
%   bob: x = l*sin(theta), z = -l*cos(theta)
%
% Made by lagrange VERSION from the scene with SHA-256
% d8ab23885144fff672c2bbbf20ccdd4e6e5060c564f9fb77ff6792c03ba61d08
% This output is yours: use it as you like, under any terms.
  f.coordinates = {'x', 'z'};
  f.parameters = {'m', 'l', 'g'};
  f.input_names = {};
  f.defaults = defaults();
  f.initial = [0.9092974268256817, 0.4161468365471424, 0.0, 0.0].';
  f.start = 0.0;
  f.until = 20.0;
  f.rhs = @rhs;
  f.mass_matrix = @mass_matrix;
  f.forcing = @forcing;
  f.energy = @energy;
  f.positions = @positions;
  f.velocities = @velocities;
  f.multipliers = @multipliers;
  f.constraints = @constraints;
  f.integrate = @integrate;
  f.project = @project;
  if nargout == 0
    main(f, varargin);
  else
    varargout = {f};
  end
end

function p = defaults()
% Parameters, with their values in the scene; NaN where it gives none.
  p = struct();
  p.m = 1.0;
  p.l_ = 1.0;
  p.g = 9.81;
end

function out = rhs(t, y, p)
% State derivative [v, a].
  if nargin < 3, p = defaults(); end
  out = zeros(4, 1);
  x = y(1);
  z = y(2);
  x_dot = y(3);
  z_dot = y(4);
  out(1) = x_dot;
  out(2) = z_dot;
  matrix = zeros(9, 1);
  vector = zeros(3, 1);
  matrix(1) = p.m;
  matrix(2) = 0.0;
  matrix(5) = p.m;
  matrix(7) = 2.0*x;
  matrix(8) = 2.0*z;
  matrix(9) = 0.0;
  vector(1) = 0.0;
  vector(2) = -p.m*p.g;
  vector(3) = -2.0*(x_dot*x_dot + z_dot*z_dot);
  vector(1:3) = solve_saddle(2, 1, matrix, vector);
  if any(isnan(vector(1:3))), out(:) = NaN; return; end
  out(3) = vector(1);
  out(4) = vector(2);
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = mass_matrix(t, y, p)
% Mass matrix M(q, t) of M a = f, n by n, by rows.
  if nargin < 3, p = defaults(); end
  out = zeros(4, 1);
  out(1) = p.m;
  out(2) = 0.0;
  out(4) = p.m;
  out(3) = out(2);
  if ~all(isfinite(out)), out(:) = NaN; end
  out = reshape(out, 2, 2).';
end

function out = forcing(t, y, p)
% Forcing f(q, v, t) of M a = f.
  if nargin < 3, p = defaults(); end
  out = zeros(2, 1);
  out(1) = 0.0;
  out(2) = -p.m*p.g;
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = energy(t, y, p)
% Energy function: the sum of v dL/dv, less L (T + V in most systems).
  if nargin < 3, p = defaults(); end
  out = zeros(1, 1);
  z = y(2);
  x_dot = y(3);
  z_dot = y(4);
  out(1) = p.m*(0.5*(x_dot*x_dot + z_dot*z_dot) + p.g*z);
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = positions(t, y, p)
% Positions, in the order of the heading.
  if nargin < 3, p = defaults(); end
  out = zeros(1, 1);
  out(1) = 0.0;
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = velocities(t, y, p)
% Time derivatives of the positions.
  if nargin < 3, p = defaults(); end
  out = zeros(1, 1);
  out(1) = 0.0;
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = multipliers(t, y, p)
% Multipliers, in the order of the closures.
  if nargin < 3, p = defaults(); end
  out = zeros(1, 1);
  x = y(1);
  z = y(2);
  x_dot = y(3);
  z_dot = y(4);
  matrix = zeros(9, 1);
  vector = zeros(3, 1);
  matrix(1) = p.m;
  matrix(2) = 0.0;
  matrix(5) = p.m;
  matrix(7) = 2.0*x;
  matrix(8) = 2.0*z;
  matrix(9) = 0.0;
  vector(1) = 0.0;
  vector(2) = -p.m*p.g;
  vector(3) = -2.0*(x_dot*x_dot + z_dot*z_dot);
  vector(1:3) = solve_saddle(2, 1, matrix, vector);
  if any(isnan(vector(1:3))), out(:) = NaN; return; end
  out(1) = vector(3);
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = constraints(t, y, p)
% Residuals: lhs - rhs of closures of positions, then rates of all closures.
  if nargin < 3, p = defaults(); end
  out = zeros(2, 1);
  x = y(1);
  z = y(2);
  x_dot = y(3);
  z_dot = y(4);
  out(1) = x*x + z*z - p.l_*p.l_;
  out(2) = 2.0*(x*x_dot + z*z_dot);
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = position_error(t, y, p)
% Residuals of closures of positions, then magnitudes of their terms.
  if nargin < 3, p = defaults(); end
  out = zeros(2, 1);
  x = y(1);
  z = y(2);
  w0 = x*x;
  w1 = z*z;
  w2 = p.l_*p.l_;
  out(1) = w0 + w1 - w2;
  out(2) = abs(w0) + abs(w1) + abs(w2) + abs(2.0*w0) + abs(2.0*w1);
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = position_reach(t, y, p)
% Squares of the gradients of closures of positions.
  if nargin < 3, p = defaults(); end
  out = zeros(1, 1);
  x = y(1);
  z = y(2);
  out(1) = 4.0*(x*x + z*z)/p.m;
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = position_change(t, y, p)
% Change of q that leads to the closures, in the metric of the energy.
  if nargin < 3, p = defaults(); end
  out = zeros(2, 1);
  x = y(1);
  z = y(2);
  matrix = zeros(9, 1);
  vector = zeros(3, 1);
  matrix(1) = p.m;
  matrix(2) = 0.0;
  matrix(5) = p.m;
  matrix(7) = 2.0*x;
  matrix(8) = 2.0*z;
  matrix(9) = 0.0;
  vector(1) = 0.0;
  vector(2) = 0.0;
  vector(3) = -x*x - z*z + p.l_*p.l_;
  vector(1:3) = solve_saddle(2, 1, matrix, vector);
  if any(isnan(vector(1:3))), out(:) = NaN; return; end
  out(1) = vector(1);
  out(2) = vector(2);
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = velocity_error(t, y, p)
% Residuals of the rates of closures, then magnitudes of their terms.
  if nargin < 3, p = defaults(); end
  out = zeros(2, 1);
  x = y(1);
  z = y(2);
  x_dot = y(3);
  z_dot = y(4);
  w0 = x*x_dot;
  w1 = z*z_dot;
  out(1) = 2.0*(w0 + w1);
  out(2) = abs(2.0*w0) + abs(2.0*w1);
  if ~all(isfinite(out)), out(:) = NaN; end
end

function out = velocity_change(t, y, p)
% Change of v that leads to the closures, in the metric of the energy.
  if nargin < 3, p = defaults(); end
  out = zeros(2, 1);
  x = y(1);
  z = y(2);
  x_dot = y(3);
  z_dot = y(4);
  matrix = zeros(9, 1);
  vector = zeros(3, 1);
  matrix(1) = p.m;
  matrix(2) = 0.0;
  matrix(5) = p.m;
  matrix(7) = 2.0*x;
  matrix(8) = 2.0*z;
  matrix(9) = 0.0;
  vector(1) = 0.0;
  vector(2) = 0.0;
  vector(3) = -2.0*(x*x_dot + z*z_dot);
  vector(1:3) = solve_saddle(2, 1, matrix, vector);
  if any(isnan(vector(1:3))), out(:) = NaN; return; end
  out(1) = vector(1);
  out(2) = vector(2);
  if ~all(isfinite(out)), out(:) = NaN; end
end

function y = project(t, y, p)
% State led back to the closures, which it leaves in the course of integration: q by the smallest
% changes in the metric of the kinetic energy, until only rounding is left, then v. NaN in a
% singular configuration, or too far from any state that obeys the closures.
  if nargin < 3, p = defaults(); end
  n = numel(y)/2;
  last = 0;
  for number = 0:50
    errors = position_error(t, y, p);
    size = residual(errors);
    if number > 0 && size > 1
      % Coordinates are found, and rounded, together: so are magnitudes of terms.
      m = numel(errors)/2;
      lengths = sqrt(position_reach(t, y, p));
      magnitudes = max(errors(m + 1:end)./lengths)*lengths;
      magnitudes(~isfinite(magnitudes)) = 0;
      errors(m + 1:end) = max(errors(m + 1:end), magnitudes);
      size = residual(errors);
    end
    if size <= 1 || (number > 0 && size <= 1024 && 2*size > last)
      break
    end
    last = size;
    y(1:n) = y(1:n) + position_change(t, y, p);
    if number == 50
      y(:) = NaN;
    end
  end
  if ~(residual(velocity_error(t, y, p)) <= 1)
    y(n + 1:end) = y(n + 1:end) + velocity_change(t, y, p);
  end
  if ~all(isfinite(y))
    y(:) = NaN;
  end
end

function [size, errors] = residual(errors)
% The largest of residuals, in units of the last place of the magnitudes behind them.
  m = numel(errors)/2;
  units = eps*2.^floor(log2(max(errors(m + 1:end), realmin)));
  size = max(abs(errors(1:m))./units);
  if any(isnan(errors))
    size = NaN;
  end
end

function y = stepped(t, h, y, p)
% State after one classical Runge-Kutta step of size h from time t.
  slope = @(s, x) rhs(s, x, p);
  k1 = slope(t, y);
  k2 = slope(t + h/2, y + h/2*k1);
  k3 = slope(t + h/2, y + h/2*k2);
  k4 = slope(t + h, y + h*k3);
  y = y + h/6*(k1 + 2*k2 + 2*k3 + k4);
  y = project(t + h, y, p);
end

function y = integrate(y, t, finish, steps, p)
% State after so many classical Runge-Kutta steps of fixed size from t to finish.
  h = (finish - t)/steps;
  for k = 0:steps - 1
    y = stepped(t + k*h, h, y, p);
  end
end

function main(f, given)
% Integrate from the initial state and print CSV; NAME=VALUE sets parameters and initial values,
% until=T and steps=N (steps in an interval) the run.
  states = [f.coordinates, strcat('dot(', f.coordinates, ')')];
  names = [states, f.parameters, {'until', 'steps'}];
  values = [f.initial.', cell2mat(struct2cell(f.defaults)).', f.until, 20];
  for k = 1:numel(given)
    [name, text] = strtok(given{k}, '=');
    place = find(strcmp(names, name));
    number = str2double(text(2:end));
    whole = number == round(number) && number > 0;
    known = ~isempty(place) && (whole || place < numel(names));
    % Octave reads 1,5 as 15.
    if ~known || ~isreal(number) || ~isfinite(number) || any(text == ',')
      error('%s: not NAME=NUMBER with a known name', given{k});
    end
    values(place) = number;
  end
  if any(isnan(values))
    error('values needed:%s', sprintf(' %s=VALUE', names{isnan(values)}));
  end
  n = numel(states);
  y = values(1:n).';
  p = cell2struct(num2cell(values(n + 1:end - 2)).', fieldnames(f.defaults), 1);
  stated = y;
  y = project(f.start, y, p);
  scales = [max(abs(stated(1:end/2))); max(abs(stated(end/2 + 1:end)))];
  scales(2) = scales(2) + 64*eps*scales(1)/max(abs(values(end - 1) - f.start), realmin)*1e9;
  if ~all(abs(y - stated) <= 1e-9*kron(scales, ones(n/2, 1)))
    pairs = [states; num2cell(y.')];
    error('the initial state violates the constraints; nearest:%s', sprintf(' %s=%.17g', pairs{:}));
  end
  fprintf('t%s\n', sprintf(',%s', states{:}));
  for row = 0:500
    t = f.start + (values(end - 1) - f.start)*(row/500);
    if ~all(isfinite(y))
      error('stopped before t = %.17g: the mass matrix is singular or a result not finite', t);
    end
    fprintf('%.17g%s\n', t, sprintf(',%.17g', y));
    if row < 500
      next = f.start + (values(end - 1) - f.start)*((row + 1)/500);
      y = integrate(y, t, next, values(end), p);
    end
  end
end

function x = solve_saddle(n, m, matrix, vector, varargin)
% Solve M x = f + G.' l, G x + C l = g: rows of matrix hold the upper triangle of M, then G and the
% diagonal of C.
  x = equilibrated(saddle(n, n + m, matrix), vector(1:n + m));
end

function a = saddle(n, unknowns, matrix)
% The whole matrix of the equations of solve_saddle.
  a = reshape(matrix(1:unknowns^2), unknowns, unknowns).';
  inertia = triu(a(1:n, 1:n));
  gradients = a(n + 1:end, 1:n);
  a = [inertia + triu(inertia, 1).', -gradients.'; gradients, diag(diag(a(n + 1:end, n + 1:end)))];
end

function x = equilibrated(a, b)
% Solve a x = b with rows and columns of a scaled by powers of two; NaN where a is singular.
  x = NaN(size(b));
  rows = ones(size(a, 1), 1); columns = ones(1, size(a, 2));
  for k = 1:6
    scaled = abs(rows.*a.*columns);
    rows = rows.*2.^-round(log2(max(scaled, [], 2))/2);
    columns = columns.*2.^-round(log2(max(scaled, [], 1))/2);
  end
  scaled = rows.*a.*columns;
  if all(isfinite(scaled(:))) && rcond(scaled) > eps
    y = scaled\(rows.*b);
    y = y + scaled\(rows.*b - scaled*y);
    x = columns.'.*y;
  end
end
