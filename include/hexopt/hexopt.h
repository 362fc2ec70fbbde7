/* hexopt: untangles and improves hexahedral meshes. C interface.
 *
 * - All arrays belong to the caller and are only used during the call, unless a function says otherwise.
 * - Every struct starts with struct_size and version: set them with the HEXOPT_..._INIT macro or the
 *   hexopt_..._init function. A library that is newer than the program leaves what the program does not know
 * at its default; a struct newer than the library is refused with HEXOPT_USAGE.
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
#define HEXOPT_VERSION 1u

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

#ifdef __cplusplus
}
#endif

#endif
