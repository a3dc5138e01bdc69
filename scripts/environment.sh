# shellcheck shell=bash
# What runs under MPI need, sourced by the other scripts and read by the tests.
export OMP_NUM_THREADS="${OMP_NUM_THREADS:-1}"        # else BLAS threads and MPI ranks fight for the cores
export OMPI_MCA_rmaps_base_oversubscribe=1            # more ranks than cores are fine: Open MPI 4,
export PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe    # and 5
if [ "$(id -u)" = 0 ]; then                           # containers and CI run as root
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
fi
