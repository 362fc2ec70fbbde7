#define HEXOPT_HOST_KERNELS f32
#define HEXOPT_HOST_FUNCTION host_function_f32
#define HEXOPT_REAL float
#define HEXOPT_POINT_REAL float
#include "compute/host_kernels.inl"
