/* hexopt: meshes what surfaces enclose with hexahedra; untangles and improves hexahedral meshes. C interface.
 *
 * - All arrays belong to the caller and are only used during the call, unless a function says otherwise.
 * - Every struct starts with struct_size and version: set them with the HEXOPT_..._INIT macro. A library that
 * is newer than the program leaves what the program does not know at its default; a struct newer than the
 * library is refused with HEXOPT_USAGE.
 * - Functions return a status; hexopt_context_message() tells what is wrong, where, and what to do. No
 * exception and no signal leaves the library; it has no global state and prints nothing.
 * - A context serves one call at a time. Any number of contexts may be used at once from different threads.
 */
#ifndef HEXOPT_H
#define HEXOPT_H

#include <stddef.h>
#include <stdint.h>

#if defined(HEXOPT_STATIC)
#define HEXOPT_API
#else
#define HEXOPT_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/** Version of this interface: raised when a struct grows or a function is added. */
#define HEXOPT_VERSION 2u

typedef enum hexopt_status {
    HEXOPT_OK = 0,
    HEXOPT_USAGE = 2,         /**< an argument, option or struct version is wrong */
    HEXOPT_BAD_INPUT = 3,     /**< the mesh or surface is damaged or holds something unsupported */
    HEXOPT_OUTPUT_FAILED = 4, /**< a file could not be written */
    HEXOPT_NO_VALID_MESH = 5, /**< done, and the best mesh found still has invalid cells */
    HEXOPT_DEVICE = 6,        /**< the compute device does not exist or cannot be used */
    HEXOPT_OUT_OF_MEMORY = 7,
    HEXOPT_CANCELLED = 8,    /**< stopped; arrays hold the best state so far, never worse than the input */
    HEXOPT_BELOW_TARGET = 9, /**< done and valid, but below min_sj */
    HEXOPT_INTERNAL = 10     /**< a bug in the library */
} hexopt_status;

typedef enum hexopt_log_level {
    HEXOPT_LOG_DEBUG = 0,
    HEXOPT_LOG_INFO = 1,
    HEXOPT_LOG_WARNING = 2,
    HEXOPT_LOG_ERROR = 3
} hexopt_log_level;

/** One message without a newline. May be called from the thread that made the call only. */
typedef void (*hexopt_log_fn)(void* user, hexopt_log_level level, const char* message);

/** fraction: 0..1, never decreasing. Return 0 to go on, anything else to cancel. */
typedef int (*hexopt_progress_fn)(void* user, const char* stage, double fraction, const char* detail);

typedef struct hexopt_context hexopt_context;

typedef struct hexopt_context_options {
    size_t struct_size;
    uint32_t version;
    int32_t threads;             /**< 0: all cores */
    uint64_t seed;               /**< of everything random; 1 */
    hexopt_log_fn log;           /**< or NULL */
    hexopt_progress_fn progress; /**< or NULL */
    void* user;                  /**< passed to both */
} hexopt_context_options;

#define HEXOPT_CONTEXT_OPTIONS_INIT                                                                          \
    { sizeof(hexopt_context_options), HEXOPT_VERSION, 0, 1, NULL, NULL, NULL }

/** Version of the interface that the library implements. */
HEXOPT_API uint32_t hexopt_interface_version(void);
/** Version of the library, e.g. "0.1.0". */
HEXOPT_API const char* hexopt_version_string(void);
/** Short name of a status, e.g. "bad_input". */
HEXOPT_API const char* hexopt_status_name(hexopt_status status);

/** options: NULL for defaults. *context is NULL on failure. */
HEXOPT_API hexopt_status hexopt_context_create(const hexopt_context_options* options,
                                               hexopt_context** context);
/** NULL is allowed. Must not be called while a call with this context is under way. */
HEXOPT_API void hexopt_context_destroy(hexopt_context* context);
/** Ends the call under way, and no other, at its next safe point. From any thread or signal handler; without
 * a call under way it does nothing. */
HEXOPT_API void hexopt_context_cancel(hexopt_context* context);
/** Why the last call with this context did not return HEXOPT_OK, on one line; "" after success. Valid until
 * the next call with this context. */
HEXOPT_API const char* hexopt_context_message(const hexopt_context* context);

/** A hexahedral mesh in the caller's arrays. Only `positions` is ever written to. */
typedef struct hexopt_mesh {
    size_t struct_size;
    uint32_t version;
    size_t vertex_count;
    double* positions; /**< 3 * vertex_count: x, y, z of vertex 0, 1, ... in model units */
    size_t cell_count;
    const uint32_t* cells; /**< 8 * cell_count vertex numbers, 0-based, in VTK order */

    /** Hanging vertices, 0 of them for a conforming mesh: vertex hanging_vertex[i] is at the sum of
     *  weight[k] * position of master[k], k in hanging_offset[i] .. hanging_offset[i + 1] - 1. Weights of a
     * row sum to 1. A master may hang itself. */
    size_t hanging_count;
    const uint32_t* hanging_vertex; /**< hanging_count */
    const uint64_t* hanging_offset; /**< hanging_count + 1, from 0 */
    const uint32_t* hanging_master; /**< hanging_offset[hanging_count] */
    const double* hanging_weight;   /**< as many */

    /** Boundary quads that belong to a patch (a CAD face, a physical group), 0 of them where unknown. Borders
     * between patches are features. */
    size_t patch_quad_count;
    const uint32_t* patch_quads; /**< 4 * patch_quad_count vertex numbers, in either orientation */
    const uint32_t* quad_patch;  /**< patch of each; any numbers */
} hexopt_mesh;

#define HEXOPT_MESH_INIT                                                                                     \
    { sizeof(hexopt_mesh), HEXOPT_VERSION, 0, NULL, 0, NULL, 0, NULL, NULL, NULL, NULL, 0, NULL, NULL }

/** A triangulated surface that boundary vertices slide on. Patches need not be conforming. */
typedef struct hexopt_surface {
    size_t struct_size;
    uint32_t version;
    size_t vertex_count;
    const double* positions; /**< 3 * vertex_count */
    size_t triangle_count;
    const uint32_t* triangles;      /**< 3 * triangle_count, counter-clockwise from outside */
    const uint32_t* triangle_patch; /**< triangle_count, or NULL; borders between patches are features */
} hexopt_surface;

#define HEXOPT_SURFACE_INIT                                                                                  \
    { sizeof(hexopt_surface), HEXOPT_VERSION, 0, NULL, 0, NULL, NULL }

typedef enum hexopt_method { HEXOPT_METHOD_ROBUST = 0, HEXOPT_METHOD_THESIS = 1 } hexopt_method;
typedef enum hexopt_energy {
    HEXOPT_ENERGY_STRUCTURAL = 0,
    HEXOPT_ENERGY_SHAPE = 1,
    HEXOPT_ENERGY_HYPERELASTIC = 2,
    HEXOPT_ENERGY_REGULARISED = 3,
    HEXOPT_ENERGY_AUTOMATIC = 4 /**< robust: regularised, thesis: structural */
} hexopt_energy;
typedef enum hexopt_boundary { HEXOPT_BOUNDARY_FIXED = 0, HEXOPT_BOUNDARY_SLIDE = 1 } hexopt_boundary;

typedef enum hexopt_precision {
    HEXOPT_PRECISION_F32 = 0,
    HEXOPT_PRECISION_F64 = 1,
    HEXOPT_PRECISION_MIXED = 2
} hexopt_precision;

typedef struct hexopt_optimize_options {
    size_t struct_size;
    uint32_t version;
    hexopt_method method;     /**< robust; thesis needs the boundary fixed */
    hexopt_energy energy;     /**< automatic; robust: regularised, or shape (untangled input), thesis: any */
    int32_t decomposition;    /**< 8, 24 or 32 tetrahedra a cell; 32 */
    hexopt_boundary boundary; /**< slide */
    double feature_angle_deg; /**< boundary edges are features above it, 0..180; 35 */
    double max_deviation_rel; /**< 0..0.1 of the bounding-box diagonal; 0: on the surface, features exact */
    double min_sj; /**< stop when the minimum scaled Jacobian reaches it, -1..1; 1: as good as it gets */
    double time_limit_s;    /**< 0: none */
    int32_t max_iterations; /**< >= 1 */
    /** auto, cpu, vulkan, an index or part of a name; NULL: auto, a GPU where there is one and the options
     * allow, else the host. Anything but auto and cpu needs the robust method and 32 tetrahedra. */
    const char* device;
    hexopt_precision precision; /**< f64; others need the same */

    /** Segments that are features whatever the angle, 0 of them for none: on `surface`, or along edges of the
     * mesh's own boundary. Without effect on a boundary that is fixed. */
    size_t feature_segment_count;
    const double* feature_segments; /**< 6 * count: x, y, z of both ends */
    double feature_reach_rel;       /**< 0..0.01 of the diagonal: how far off they may be; 0.001 */
    /** 1..4: with slide and at most 40,000 cells, from how many states the worst cells are raised; 4 */
    int32_t starts;
} hexopt_optimize_options;

#define HEXOPT_OPTIMIZE_OPTIONS_INIT                                                                         \
    {                                                                                                        \
        sizeof(hexopt_optimize_options), HEXOPT_VERSION, HEXOPT_METHOD_ROBUST, HEXOPT_ENERGY_AUTOMATIC, 32,  \
            HEXOPT_BOUNDARY_SLIDE, 35.0, 0.0, 1.0, 0.0, 1000000, NULL, HEXOPT_PRECISION_F64, 0, NULL, 0.001, \
            4                                                                                                \
    }

/** What was reached. Counts are of cells. */
typedef struct hexopt_optimize_result {
    size_t struct_size;
    uint32_t version;
    uint64_t concave8_before, concave8_after;   /**< with a corner tetrahedron that is not positive */
    uint64_t concave32_before, concave32_after; /**< with any of all 32 tetrahedra not positive */
    double min_sj_before, min_sj_after;         /**< minimum scaled Jacobian, -1..1 */
    uint64_t infeasible;                        /**< proved to stay bad whatever the free vertices do */
    double max_deviation; /**< two-sided, of the boundary from the surface, model units; 0 if fixed */
    double seconds;
} hexopt_optimize_result;

#define HEXOPT_OPTIMIZE_RESULT_INIT                                                                          \
    { sizeof(hexopt_optimize_result), HEXOPT_VERSION, 0, 0, 0, 0, 0.0, 0.0, 0, 0.0, 0.0 }

/** Moves mesh->positions; connectivity stays. Never worse: the counts and the minimum scaled Jacobian never
 * end below the input's. surface: what the boundary slides on, NULL for the mesh's own boundary. options:
 * NULL for defaults. result: NULL or where to write. HEXOPT_OK, HEXOPT_NO_VALID_MESH, HEXOPT_BELOW_TARGET and
 * HEXOPT_CANCELLED leave the best state in mesh->positions and fill *result (cancelled before the first step:
 * nothing is touched); any other status leaves both as they were. */
HEXOPT_API hexopt_status hexopt_optimize(hexopt_context* context, hexopt_mesh* mesh,
                                         const hexopt_surface* surface,
                                         const hexopt_optimize_options* options,
                                         hexopt_optimize_result* result);

/** A Vulkan device of the host application. It must have been created with bufferDeviceAddress,
 * scalarBlockLayout and timelineSemaphore, and shaderFloat64 where f64 is not 0. Handles stay the caller's.
 */
typedef struct hexopt_vulkan {
    size_t struct_size;
    uint32_t version;
    void* get_instance_proc_addr; /**< PFN_vkGetInstanceProcAddr */
    void* instance;               /**< VkInstance */
    void* physical_device;        /**< VkPhysicalDevice */
    void* device;                 /**< VkDevice */
    void* queue;                  /**< VkQueue of a family with VK_QUEUE_COMPUTE_BIT */
    uint32_t queue_family;
    int32_t f64;              /**< not 0: shaderFloat64 is enabled */
    void (*lock)(void* user); /**< the queue is used only between lock and unlock; both or neither NULL */
    void (*unlock)(void* user);
    void* user;
} hexopt_vulkan;

#define HEXOPT_VULKAN_INIT                                                                                   \
    { sizeof(hexopt_vulkan), HEXOPT_VERSION, NULL, NULL, NULL, NULL, NULL, 0, 0, NULL, NULL, NULL }

/** A mesh in buffers of the host application's device. The buffers need storage, transfer (both ways) and
 *  device-address usage, and must be idle during the call; offsets are in bytes, multiples of 4. */
typedef struct hexopt_device_mesh {
    size_t struct_size;
    uint32_t version;
    size_t vertex_count;
    void* positions; /**< VkBuffer: x, y, z of vertex 0, 1, ... without gaps; the only one written to */
    uint64_t positions_offset;
    int32_t positions_are_f32; /**< 0: double, else float */
    size_t cell_count;
    void* cells; /**< VkBuffer: 8 uint32 a cell, as in hexopt_mesh */
    uint64_t cells_offset;
    size_t hanging_count; /**< as in hexopt_mesh, in host memory */
    const uint32_t* hanging_vertex;
    const uint64_t* hanging_offset;
    const uint32_t* hanging_master;
    const double* hanging_weight;
} hexopt_device_mesh;

#define HEXOPT_DEVICE_MESH_INIT                                                                              \
    { sizeof(hexopt_device_mesh), HEXOPT_VERSION, 0, NULL, 0, 0, 0, NULL, 0, 0, NULL, NULL, NULL, NULL }

/** hexopt_optimize() in place in the host application's device memory, computed on its device. options: as
 * there, but `device` is not used (NULL: defaults with a fixed boundary). */
HEXOPT_API hexopt_status hexopt_optimize_on_device(hexopt_context* context, const hexopt_vulkan* vulkan,
                                                   const hexopt_device_mesh* mesh,
                                                   const hexopt_optimize_options* options,
                                                   hexopt_optimize_result* result);

/** Validity and quality of a mesh. Counts are of cells. */
typedef struct hexopt_quality {
    size_t struct_size;
    uint32_t version;
    uint64_t concave8, concave32; /**< as in hexopt_optimize_result */
    uint64_t valid, invalid,
        undecided;          /**< of the trilinear map: proved, disproved, neither within rounding */
    double min_sj, mean_sj; /**< scaled Jacobian */
    uint64_t worst_cell;    /**< cell with min_sj */
} hexopt_quality;

#define HEXOPT_QUALITY_INIT                                                                                  \
    { sizeof(hexopt_quality), HEXOPT_VERSION, 0, 0, 0, 0, 0, 0.0, 0.0, 0 }

/** Measures a mesh; mesh->positions is only read. */
HEXOPT_API hexopt_status hexopt_measure(hexopt_context* context, const hexopt_mesh* mesh,
                                        hexopt_quality* quality);

/** A mesh that the library made and owns. */
typedef struct hexopt_volume hexopt_volume;

/** What hexopt_mesh_surface() reached. */
typedef struct hexopt_mesh_result {
    size_t struct_size;
    uint32_t version;
    uint64_t vertices, cells;
    uint64_t concave32, invalid; /**< cells: as in hexopt_quality; both 0 in a valid mesh */
    uint64_t contacts;           /**< boundary quads where the boundary touches itself; 0 in a valid mesh */
    double min_sj, mean_sj;      /**< scaled Jacobian */
    uint64_t curves, curves_captured; /**< feature curves of the surface; those that mesh edges follow */
    uint64_t backed_off;              /**< boundary vertices that had to leave the surface for valid cells */
    double max_deviation;             /**< two-sided, of the boundary from the surface, model units */
    double seconds;
} hexopt_mesh_result;

#define HEXOPT_MESH_RESULT_INIT                                                                              \
    { sizeof(hexopt_mesh_result), HEXOPT_VERSION, 0, 0, 0, 0, 0, 0.0, 0.0, 0, 0, 0, 0.0, 0.0 }

/** Meshes what a surface encloses, in space, with hexahedra and hanging vertices. Triangles may point either
 * way; small gaps are closed. config: TOML with the keys of `hexopt-gpu mesh --dump-config`, e.g.
 * "[refine]\ncells = 50000\n" (NULL: defaults); keys that name files are refused, those of writing and of CAD
 * files have no meaning here. result: NULL or where to write. HEXOPT_OK, HEXOPT_NO_VALID_MESH,
 * HEXOPT_BELOW_TARGET, and HEXOPT_CANCELLED once optimizing has begun, set *volume, to be freed with
 * hexopt_volume_destroy(), and fill *result; otherwise *volume is NULL. Since version 2. */
HEXOPT_API hexopt_status hexopt_mesh_surface(hexopt_context* context, const hexopt_surface* surface,
                                             const char* config, hexopt_volume** volume,
                                             hexopt_mesh_result* result);
/** The arrays of a volume, with patches of all boundary quads (quad_patch: see hexopt_volume_patch_name()).
 * Valid until it is destroyed; positions may be changed, e.g. by hexopt_optimize(). Since version 2. */
HEXOPT_API hexopt_mesh hexopt_volume_mesh(hexopt_volume* volume);
/** Refinement level of each cell. Since version 2. */
HEXOPT_API const uint8_t* hexopt_volume_level(const hexopt_volume* volume);
/** Number of patches. Since version 2. */
HEXOPT_API uint32_t hexopt_volume_patch_count(const hexopt_volume* volume);
/** Name of a patch: its number in triangle_patch as decimal digits, "surface" without such, or
 * "farfield_x_min" and the like; NULL where there is no such patch. Since version 2. */
HEXOPT_API const char* hexopt_volume_patch_name(const hexopt_volume* volume, uint32_t patch);
/** NULL is allowed. Since version 2. */
HEXOPT_API void hexopt_volume_destroy(hexopt_volume* volume);

#ifdef __cplusplus
}
#endif

#endif
