! Two masses, a cubic spring between them; the first one slides on a belt with Stribeck friction.
! PAR(1): speed of the belt, m/s; PAR(2): kinetic friction.
subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: mu, fall, stretch, spring, slope
  mu = par(2) + (0.6d0 - par(2)) * exp(-(par(1) - u(3)) / 0.5d0)
  stretch = u(1) - u(2)
  spring = 0.5d0 * stretch + 0.8d0 * stretch**3
  f(1) = u(3)
  f(2) = u(4)
  f(3) = -0.06d0 * u(3) - u(1) - spring + 2.0d0 * mu
  f(4) = (-0.1d0 * u(4) - 1.5d0 * u(2) + spring) / 0.7d0
  if (ijac == 0) return
  slope = 0.5d0 + 2.4d0 * stretch**2
  fall = exp(-(par(1) - u(3)) / 0.5d0)
  dfdu = 0.0d0
  dfdu(1, 3) = 1.0d0
  dfdu(2, 4) = 1.0d0
  dfdu(3, 1) = -1.0d0 - slope
  dfdu(3, 2) = slope
  dfdu(3, 3) = -0.06d0 + 2.0d0 * (0.6d0 - par(2)) * fall / 0.5d0
  dfdu(4, 1) = slope / 0.7d0
  dfdu(4, 2) = (-1.5d0 - slope) / 0.7d0
  dfdu(4, 4) = -0.1d0 / 0.7d0
  if (ijac == 1) return
  dfdp(:, 1:2) = 0.0d0
  dfdp(3, 1) = -2.0d0 * (0.6d0 - par(2)) * fall / 0.5d0
  dfdp(3, 2) = 2.0d0 * (1.0d0 - fall)
end subroutine func

subroutine stpnt(ndim, u, par, t)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  double precision :: mu, a, b, stretch, spring, slope
  integer :: k
  par(1:2) = (/ 2.0d0, 0.2d0 /)
  mu = par(2) + (0.6d0 - par(2)) * exp(-par(1) / 0.5d0)
  ! At rest: (2 mu - s) - s / 1.5 is the stretch, s the force of the spring.
  stretch = 0.0d0
  do k = 1, 50
    spring = 0.5d0 * stretch + 0.8d0 * stretch**3
    slope = 0.5d0 + 2.4d0 * stretch**2
    stretch = stretch - (2.0d0 * mu - spring * (5.0d0 / 3.0d0) - stretch) / (-slope * (5.0d0 / 3.0d0) - 1.0d0)
  end do
  spring = 0.5d0 * stretch + 0.8d0 * stretch**3
  u(1:4) = (/ 2.0d0 * mu - spring, spring / 1.5d0, 0.0d0, 0.0d0 /)
end subroutine stpnt

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
  integer :: ndim, icp(*), nbc, ijac
  double precision :: par(*), u0(ndim), u1(ndim), fb(nbc), dbc(nbc, *)
end subroutine bcnd

subroutine icnd(ndim, par, icp, nint, u, uold, udot, upold, fi, ijac, dint)
  integer :: ndim, icp(*), nint, ijac
  double precision :: par(*), u(ndim), uold(ndim), udot(ndim), upold(ndim), fi(nint), dint(nint, *)
end subroutine icnd

subroutine fopt(ndim, u, icp, par, ijac, fs, dfdu, dfdp)
  integer :: ndim, icp(*), ijac
  double precision :: u(ndim), par(*), fs, dfdu(ndim), dfdp(*)
end subroutine fopt

subroutine pvls(ndim, u, par)
  integer :: ndim
  double precision :: u(ndim), par(*)
end subroutine pvls
