!> Explicit interfaces of the double precision LAPACK routines this program calls.
!>
!> Arguments have LAPACK's own names and meaning (www.netlib.org/lapack). Matrices are assumed-size with a leading dimension, so
!> that an array section needs no copy and a vector can be passed as a matrix of one column.
module lapack
   use kinds, only: wp
   implicit none
   private
   public :: dgetrf, dgetrs, dgetri, dgelsd
   public :: dpotrf, dpotrs, dpotri, dsytrf, dsytrs
   public :: dpbtrf, dpbtrs
   public :: dgbtrf, dgbtrs
   public :: dptsv
   public :: dsyev, dgeev

   ! Dense general matrices:
   interface

      !> LU factors of a dense matrix, with row exchanges.
      subroutine dgetrf(m, n, a, lda, ipiv, info)
         import :: wp
         integer, intent(in) :: m, n, lda
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*)
         integer, intent(out) :: info !! > 0: U(info, info) is exactly zero
      end subroutine dgetrf

      !> Solves a dense system with the factors of dgetrf.
      subroutine dgetrs(trans, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         character, intent(in) :: trans
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(in) :: a(lda, *)
         integer, intent(in) :: ipiv(*)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dgetrs

      !> Eigenvalues of a symmetric matrix in ascending order; eigenvectors in A.
      subroutine dsyev(jobz, uplo, n, a, lda, w, work, lwork, info)
         import :: wp
         character, intent(in) :: jobz, uplo
         integer, intent(in) :: n, lda, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: w(*)
         real(wp), intent(inout) :: work(*)
         integer, intent(out) :: info
      end subroutine dsyev

      !> Eigenvalues and eigenvectors of a general matrix.
      subroutine dgeev(jobvl, jobvr, n, a, lda, wr, wi, vl, ldvl, vr, ldvr, work, lwork, info)
         import :: wp
         character, intent(in) :: jobvl, jobvr
         integer, intent(in) :: n, lda, ldvl, ldvr, lwork
         real(wp), intent(inout) :: a(lda, *)
         real(wp), intent(out) :: wr(*), wi(*)
         real(wp), intent(inout) :: vl(ldvl, *), vr(ldvr, *), work(*)
         integer, intent(out) :: info
      end subroutine dgeev

      !> Cholesky factors of a symmetric positive definite matrix.
      subroutine dpotrf(uplo, n, a, lda, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info !! > 0: the leading minor of this order is not positive
      end subroutine dpotrf

      subroutine dpotrs(uplo, n, nrhs, a, lda, b, ldb, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(in) :: a(lda, *)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dpotrs

      !> Inverse from the factors of dpotrf, stored in the same triangle.
      subroutine dpotri(uplo, n, a, lda, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dpotri

      !> Factors U D U^T or L D L^T of a symmetric matrix; D has blocks of order 1 and 2 (Bunch-Kaufman).
      subroutine dsytrf(uplo, n, a, lda, ipiv, work, lwork, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda, lwork
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(out) :: ipiv(*) !! < 0 in both rows of a block of order 2
         real(wp), intent(inout) :: work(*)
         integer, intent(out) :: info !! > 0: D(info, info) is exactly zero
      end subroutine dsytrf

      !> Solves a symmetric system with the factors of dsytrf.
      subroutine dsytrs(uplo, n, nrhs, a, lda, ipiv, b, ldb, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, nrhs, lda, ldb
         real(wp), intent(in) :: a(lda, *)
         integer, intent(in) :: ipiv(*)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dsytrs

      !> Inverse from the factors of dgetrf.
      subroutine dgetri(n, a, lda, ipiv, work, lwork, info)
         import :: wp
         integer, intent(in) :: n, lda, lwork
         real(wp), intent(inout) :: a(lda, *)
         integer, intent(in) :: ipiv(*)
         real(wp), intent(out) :: work(*)
         integer, intent(out) :: info !! > 0: U(info, info) is exactly zero
      end subroutine dgetri

      !> Solves a linear least-squares problem by singular values; the result is the solution of least norm.
      subroutine dgelsd(m, n, nrhs, a, lda, b, ldb, s, rcond, rank, work, lwork, iwork, info)
         import :: wp
         integer, intent(in) :: m, n, nrhs, lda, ldb, lwork
         real(wp), intent(inout) :: a(lda, *), b(ldb, *)
         real(wp), intent(out) :: s(*)
         real(wp), intent(in) :: rcond
         integer, intent(out) :: rank
         real(wp), intent(out) :: work(*)
         integer, intent(out) :: iwork(*), info
      end subroutine dgelsd

   end interface

   ! Banded and tridiagonal matrices:
   interface

      !> Cholesky factors of a symmetric positive definite band matrix.
      subroutine dpbtrf(uplo, n, kd, ab, ldab, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, kd, ldab
         real(wp), intent(inout) :: ab(ldab, *)
         integer, intent(out) :: info !! > 0: the leading minor of this order is not positive
      end subroutine dpbtrf

      !> Solves a band system with the factors of dpbtrf.
      subroutine dpbtrs(uplo, n, kd, nrhs, ab, ldab, b, ldb, info)
         import :: wp
         character, intent(in) :: uplo
         integer, intent(in) :: n, kd, nrhs, ldab, ldb
         real(wp), intent(in) :: ab(ldab, *)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dpbtrs

      !> LU factors of a general band matrix, with row exchanges.
      subroutine dgbtrf(m, n, kl, ku, ab, ldab, ipiv, info)
         import :: wp
         integer, intent(in) :: m, n, kl, ku, ldab
         real(wp), intent(inout) :: ab(ldab, *)
         integer, intent(out) :: ipiv(*)
         integer, intent(out) :: info !! > 0: U(info, info) is exactly zero
      end subroutine dgbtrf

      !> Solves a band system with the factors of dgbtrf.
      subroutine dgbtrs(trans, n, kl, ku, nrhs, ab, ldab, ipiv, b, ldb, info)
         import :: wp
         character, intent(in) :: trans
         integer, intent(in) :: n, kl, ku, nrhs, ldab, ldb
         real(wp), intent(in) :: ab(ldab, *)
         integer, intent(in) :: ipiv(*)
         real(wp), intent(inout) :: b(ldb, *)
         integer, intent(out) :: info
      end subroutine dgbtrs

      !> Factors and solves a symmetric positive definite tridiagonal system.
      subroutine dptsv(n, nrhs, d, e, b, ldb, info)
         import :: wp
         integer, intent(in) :: n, nrhs, ldb
         real(wp), intent(inout) :: d(*), e(*), b(ldb, *)
         integer, intent(out) :: info !! > 0: the leading minor of this order is not positive
      end subroutine dptsv

   end interface
end module lapack
