/* palpate.h: palpate in other programs. C99, and C++.

   A person puts a hand into a moving volume: palpate estimates how the data move, renders the
   forces, and draws the picture. Here all of that is functions over opaque handles:

   - PalContext: the device that computes, palpate's own or the host's Vulkan device.
   - PalEstimator: takes frames and estimates their motion; PalMotion: the motion that it found.
   - PalScene: what there is to feel and see.
   - PalSession: a scene that is felt, by a haptic thread of palpate's or in the host's haptic loop.
   - PalView: pictures of a session, into the host's images or into memory.

   Rules

   - Every structure begins with its size: set it to sizeof, and all that is not needed to 0. A
     program that was compiled with an older header goes on to work: what its structures lack is 0.
     A larger size than the library knows is PAL_BAD_VERSION, in whatever structure it stands. What
     can grow is pointed to by other structures, not part of them. (PalGrid, PalReading, PalTick and
     PalEye have no size: they never change.)
   - Functions return a PalResult: 0 is success, below 0 is a failure, above 0 is "not yet" or "no
     more". After a failure pal_last_error() has a sentence for people, for this thread.
   - Closing takes the handle's address and sets it to NULL. Closing NULL is no error. A call with
     NULL, or with a handle that another thread has closed, fails with PAL_BAD_INPUT; closing waits
     for calls that are running.
   - Callbacks get the `user` pointer that was given with them, and hold no lock of the library's.
     They may call every function except those that close, stop or finish what calls them.
   - A callback should not throw, but a host in C++ may: what it throws ends there, and is told in a
     sentence. on_progress: the estimation is cancelled, and pal_estimator_finish() says it.
     exchange: a fault of the device, so the force goes to zero by a ramp, and an event of kind
     PAL_EVENT_NOTE. on_event, unlock_queue: the context's log. lock_queue: nothing is submitted,
     and the call that needed the queue fails with PAL_DEVICE_FAILED. A mode: it is left out, and an
     event of kind PAL_EVENT_NOTE. log: dropped.
   - The library never exits, aborts, prints, sets the locale or a signal handler, or throws over
     the boundary.
   - Memory comes from the C++ runtime's allocator; there is no hook for it, since parts of that
     runtime allocate by themselves.
   - Threads: [RT] real-time safe: no lock, no allocation, no system call; [ANY] any thread.
   - Units: haptics m, N, s in the device's space (x right, y up, z towards the user); the world is
     m, right-handed, y up; grids and motion fields are mm in the patient's space (LPS), as ITK has
     them. A volume's own space is m, y up: x = L, y = S, z = -P of its patient, times 0.001. */
#ifndef PALPATE_H
#define PALPATE_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define PAL_API
#else
#define PAL_API __attribute__((visibility("default")))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- version, results, grids ---- */

#define PAL_VERSION_MAJOR 0
#define PAL_VERSION_MINOR 1
#define PAL_VERSION_PATCH 0
#define PAL_VERSION \
  (((uint32_t)PAL_VERSION_MAJOR << 16) | (PAL_VERSION_MINOR << 8) | PAL_VERSION_PATCH)

/* Of the library, as PAL_VERSION is of this header. [RT] */
PAL_API uint32_t pal_version(void);

typedef enum PalResult {
  PAL_OK = 0,
  PAL_NOT_YET = 1,        /* nothing is wrong: ask again later */
  PAL_END = 2,            /* there is no such thing any more: the end of a list */
  PAL_BAD_INPUT = -1,     /* data or arguments are wrong: the sentence says what to change */
  PAL_BAD_OUTPUT = -2,    /* a result could not be written: nothing was touched */
  PAL_NO_DEVICE = -3,     /* no device that can do the work */
  PAL_DEVICE_FAILED = -4, /* the device was lost, or its driver refused */
  PAL_OUT_OF_MEMORY = -5, /* the host or the device can not hold the work */
  PAL_CANCELLED = -6,     /* as was asked for */
  PAL_BAD_VERSION = -7,   /* header and library do not fit together */
  PAL_INTERNAL = -8       /* a fault of the library's own: please report it */
} PalResult;

/* "PAL_BAD_INPUT". Static. [RT] */
PAL_API const char* pal_result_name(PalResult result);

/* The sentence on this thread's last failure, "" before the first; valid until this thread's next
 * call. [ANY] */
PAL_API const char* pal_last_error(void);

/* Where samples lie: sample (i, j, k) at index i + size[0] * (j + size[1] * k) has its centre at
 * origin + direction * (spacing * (i, j, k)). */
typedef struct PalGrid {
  uint32_t size[3];
  double spacing_mm[3]; /* more than 0 */
  double origin_mm[3];  /* LPS */
  double direction[9]; /* three rows of a rotation matrix, whose columns are the directions of i, j,
                          k in LPS; all 0: the unit matrix */
} PalGrid;

typedef enum PalSampleType {
  PAL_FLOAT32 = 0,
  PAL_FLOAT64 = 1,
  PAL_INT8 = 2,
  PAL_UINT8 = 3,
  PAL_INT16 = 4,
  PAL_UINT16 = 5,
  PAL_INT32 = 6,
  PAL_UINT32 = 7,
  PAL_SAMPLE_TYPE_MAX = 0x7fffffff /* no type: any number may be given, wrong ones are refused */
} PalSampleType;

/* ---- contexts ---- */

typedef struct PalContext PalContext;

enum {
  /* There is no device that computes: forces only, and motion is not estimated. */
  PAL_CONTEXT_NO_GPU = 1u << 0
};

/* A host's Vulkan device, which the library goes on to share. Made with Vulkan 1.2 or later and
   with the feature shaderStorageImageWriteWithoutFormat; the queue has compute and, for pictures in
   the host's images, is the one that draws them. It must outlive the context. Handles are Vulkan's
   own. */
typedef struct PalVulkan {
  uint32_t size; /* sizeof(PalVulkan) */
  uint32_t queue_family;
  void* instance;        /* VkInstance */
  void* physical_device; /* VkPhysicalDevice */
  void* device;          /* VkDevice */
  void* queue;           /* VkQueue */
  /* 1: made with the feature shaderStorageImageExtendedFormats, which saves memory. */
  uint32_t has_extended_formats;
  /* Around every use of the queue, on any thread; NULL where nobody else uses it meanwhile. */
  void (*lock_queue)(void* user);
  void (*unlock_queue)(void* user);
  void* user;
} PalVulkan;

typedef struct PalContextInfo {
  uint32_t size;      /* sizeof(PalContextInfo) */
  uint32_t version;   /* PAL_VERSION */
  uint32_t flags;     /* PAL_CONTEXT_... */
  const char* device; /* a Vulkan device, by number or part of its name; NULL: the first GPU, else
                         the CPU */
  const PalVulkan* vulkan;   /* instead: the host's; NULL: the library opens a device of its own */
  uint64_t memory_cap_bytes; /* use no more device memory; 0: what there is */
  /* Called with sentences on what the library does, on any thread; NULL: not called. */
  void (*log)(void* user, const char* sentence);
  void* user;
} PalContextInfo;

/* [ANY] */
PAL_API PalResult pal_context_open(const PalContextInfo* info, PalContext** context);
/* What was opened with the context goes on, and ends with the last of it. [ANY] */
PAL_API PalResult pal_context_close(PalContext** context);
/* The name of the device that computes, "" without one; valid until the context is closed. [ANY] */
PAL_API const char* pal_context_device(const PalContext* context);

/* ---- motion ----

   How the material moves between frames that a program has in memory. A displacement field says,
   for each sample x of the fixed frame, that its material is at x + u(x) in the moving frame; u in
   mm along L, P, S, as in an ITK displacement field. */

typedef struct PalEstimator PalEstimator;
typedef struct PalMotion PalMotion;

enum {
  /* Three frames and more: only the fields from each frame to the next, not one motion for all. */
  PAL_ESTIMATOR_PAIRWISE = 1u << 0,
  /* The last frame leads back to the first. */
  PAL_ESTIMATOR_CYCLIC = 1u << 1,
  /* Nothing is measured for a verdict, which takes about as long again as a pair. */
  PAL_ESTIMATOR_NO_VERDICT = 1u << 2
};

typedef struct PalEstimatorInfo {
  uint32_t size;      /* sizeof(PalEstimatorInfo) */
  uint32_t flags;     /* PAL_ESTIMATOR_... */
  PalGrid grid;       /* of all frames */
  const char* preset; /* "fast", "balanced", "best" or "classic"; NULL: "balanced" */
  /* One byte per sample of the grid, 0: does not count; NULL: all count. Read during the call. */
  const uint8_t* mask;
  /* Called with what is being done and the share of the work that is done, 0 to 1, on the
     estimator's threads; NULL: not called. It may cancel. */
  void (*on_progress)(void* user, const char* doing, double share);
  void* user;
  uint32_t iterations; /* at most so many on each level; 0: as the preset has it */
} PalEstimatorInfo;

/* The context needs a device that computes. [ANY] */
PAL_API PalResult pal_estimator_open(PalContext* context, const PalEstimatorInfo* info,
                                     PalEstimator** estimator);

/* Takes the next frame: grid.size[0] * [1] * [2] samples, x fastest, read during the call. Work on
   a pair begins with its second frame where pairs are all that is wanted. time_s: when it was
   taken, above the last one's; below 0: one second after it. [ANY] */
PAL_API PalResult pal_estimator_push(PalEstimator* estimator, PalSampleType type,
                                     const void* samples, double time_s);

/* How far an estimator is. */
typedef struct PalProgress {
  uint32_t size;          /* sizeof(PalProgress), set before the call */
  uint32_t frames_pushed; /* so far */
  uint32_t steps_found;   /* fields from a frame to the next that are known */
  uint32_t is_finished;   /* 1: pal_estimator_finish() has given the motion */
  double share;           /* of the work on the frames that were pushed, 0 to 1 */
} PalProgress;

/* Does not wait: for a host that asks now and then, while pal_estimator_finish() waits on another
   thread. [ANY] */
PAL_API PalResult pal_estimator_poll(const PalEstimator* estimator, PalProgress* progress);

/* No more frames: waits for the motion. PAL_CANCELLED after pal_estimator_cancel(). Once. [ANY] */
PAL_API PalResult pal_estimator_finish(PalEstimator* estimator, PalMotion** motion);

/* Stops as soon as the device has done what it is doing; the estimator can only be closed then.
 * [ANY], also from on_progress. */
PAL_API PalResult pal_estimator_cancel(PalEstimator* estimator);

/* Cancels what is still running. Not from on_progress. [ANY] */
PAL_API PalResult pal_estimator_close(PalEstimator** estimator);
PAL_API PalResult pal_motion_close(PalMotion** motion);

/* One motion for all frames, from the one file that `palpate motion` and pal_motion_save() write.
   The file does not hold the frames' grid: what is "the frames'" below is that on which the motion
   was solved, around the same place with fewer samples. Give the frames' grid where a field or a
   frame on it is wanted (PalFieldInfo.grid): pal_motion_warp() takes the frame to be on it, too.
   [ANY] */
PAL_API PalResult pal_motion_open(PalContext* context, const char* path, PalMotion** motion);

typedef enum PalTrust {
  PAL_TRUST_UNKNOWN = 0, /* nothing was measured */
  PAL_TRUST_OK = 1,
  PAL_TRUST_SUSPECT = 2, /* a person should look before using it */
  PAL_TRUST_FAILED = 3   /* do not use it */
} PalTrust;

/* A motion in numbers, and what was measured to judge it; of several fields the worst one counts.
   NaN where nothing was measured. */
typedef struct PalMotionSummary {
  uint32_t size; /* sizeof(PalMotionSummary), set before the call */
  uint32_t frame_count;
  uint32_t step_count;      /* fields from a frame to the next */
  uint32_t is_whole;        /* 1: one motion for all frames, from a reference frame */
  uint32_t reference_frame; /* that frame, where is_whole */
  uint32_t harmonics;       /* of the cycle; 0: curves through the frames */
  double cycle_s;           /* 0: not cyclic */
  PalGrid grid;             /* of the frames */
  PalTrust trust;
  const char* trust_word; /* "ok", "suspect", "failed", or "" */
  /* What speaks against it, a sentence per line; valid until the motion is closed. */
  const char* reasons;
  double seconds; /* that the estimation took */
  double motion_mean_mm, motion_max_mm;
  double folded_voxels;                         /* where the field folds space */
  double least_determinant;                     /* of I + grad u */
  double correlation_before, correlation_after; /* local, mean */
  double motion_left_voxels;                    /* that the frames still show */
  double drift_mean_mm; /* after one cycle of the fields from frame to frame */
} PalMotionSummary;

/* [ANY] */
PAL_API PalResult pal_motion_summary(const PalMotion* motion, PalMotionSummary* summary);

enum {
  /* From the reference frame to `time_s`, as the frames' times count, instead of from frame `step`
     to the next. Only where is_whole. */
  PAL_FIELD_TO_TIME = 1u << 0,
  /* The inverse: from there back. */
  PAL_FIELD_INVERSE = 1u << 1
};

/* Which field, and at which samples. */
typedef struct PalFieldInfo {
  uint32_t size;  /* sizeof(PalFieldInfo) */
  uint32_t flags; /* PAL_FIELD_... */
  uint32_t step;
  double time_s;
  const PalGrid* grid; /* NULL: the frames' */
} PalFieldInfo;

/* u at the grid's samples: 3 * grid.size[0] * [1] * [2] floats, x, y, z of a sample side by side,
 * mm. [ANY] */
PAL_API PalResult pal_motion_field(const PalMotion* motion, const PalFieldInfo* info,
                                   float* xyz_mm);

/* How far a field may be trusted at each sample, 0 (a guess) to 1, of a step, or of the field from
   the reference frame to frame `step` where is_whole. flags and time_s are not looked at. [ANY] */
PAL_API PalResult pal_motion_confidence(const PalMotion* motion, const PalFieldInfo* info,
                                        float* values);

/* A frame carried along a field: at each sample x of the grid the value at x + u(x) of the frame,
   linear between samples, its border value clamped outside. The frame has the frames' grid. [ANY]
 */
PAL_API PalResult pal_motion_warp(const PalMotion* motion, const PalFieldInfo* info,
                                  PalSampleType type, const void* samples, float* warped);

/* Writes a field for ITK and what reads its fields (.mha, .nrrd, .nii, .nii.gz). info NULL: the one
   motion for all frames, as one file
   (.nrrd) that palpate reads again. All of the file or none. [ANY] */
PAL_API PalResult pal_motion_save(const PalMotion* motion, const PalFieldInfo* info,
                                  const char* path);

/* ---- scenes ----

   What there is to feel and see: volumes with their data, haptic modes, a spring. Immutable after
   it was opened; any number of sessions may use one scene, also after it was closed. */

typedef struct PalScene PalScene;

/* Frames in memory, which stand in place of a file. Read during the call alone. */
typedef struct PalFrames {
  uint32_t size;    /* sizeof(PalFrames) */
  const char* name; /* takes the place of a file's name: among the paths of PalSceneInfo, or in a
                       scene's "files" */
  PalGrid grid;     /* of every frame */
  PalSampleType sample_type;
  const void* const* frames; /* frame_count arrays of grid.size[0] * [1] * [2] samples, x fastest */
  uint32_t frame_count;
  /* frame_count rising times; NULL: one frame a second, or as PalSceneInfo says. */
  const double* times_s;
  const PalMotion* motion; /* of these frames; NULL: it is found while they are felt */
} PalFrames;

enum {
  /* Volumes that nothing moves may be placed by the host, see pal_session_place(). */
  PAL_SCENE_MOVABLE = 1u << 0,
  /* A sequence without a scene keeps its size; else it is shrunk to the device's reach when a
     session opens. */
  PAL_SCENE_TRUE_SIZE = 1u << 1,
  /* The sequence has an end: it does not go on with its first frame after the last. */
  PAL_SCENE_NOT_CYCLIC = 1u << 2,
  /* The one frame of `frames` is the first of a source without end, felt as a sequence without a
     scene: the host gives the others to the session, see pal_session_push_frame(). */
  PAL_SCENE_LIVE = 1u << 3,
  /* Motion that nothing gives is not looked for: the frames are felt as they are. */
  PAL_SCENE_NO_MOTION = 1u << 4
};

typedef struct PalSceneInfo {
  uint32_t size;            /* sizeof(PalSceneInfo) */
  uint32_t flags;           /* PAL_SCENE_... */
  const char* const* paths; /* a scene file (.json, .x3d), a folder, a 4D file, files of frames in
                               order, the name of a PalFrames, "heart", "shell", "molecule", or
                               "igtl://HOST:PORT": the images of an OpenIGTLink server. Of these
                               the first one is waited for, and each session that is opened
                               connects for itself and follows those that come */
  uint32_t path_count;
  const char* json; /* instead of paths: a scene in the format of docs/scene-file.md */
  /* Where the paths of a scene begin; NULL: beside its file, or the working folder. */
  const char* folder;
  const PalFrames* frames; /* frame_sets of them */
  uint32_t frame_sets;
  const char* const* mode_libraries; /* haptic modes of your own, see docs/writing-a-mode.md */
  uint32_t mode_library_count;
  /* A sequence without a scene: */
  const double* iso_value;  /* of the surface to feel; NULL: found in the data */
  double strength_n;        /* the surface holds as much; 0: 4 */
  double friction;          /* Coulomb's mu; 0: 0.2; below 0: none */
  double frames_per_second; /* 0: as the data say */
  const char* fields;       /* folder or file that `palpate motion` wrote; NULL: none */
  /* Of a sequence without a scene, too; each as the option of the program of that name has it. */
  const char* wall;   /* "values", "region" or "ridges"; NULL: what suits the data */
  const char* values; /* "reference", "mean" or "own"; NULL: what suits the motion. Of a scene's
                         volumes of files, too */
  double width;       /* over so many values around iso_value the strength rises; 0: found */
  double scale;       /* of its size; 0: as the flags say */
  const char* const* segments; /* segmentation_count files, whose parts are the walls */
  uint32_t segmentation_count;
  uint32_t segments_frame;          /* the frame that a single segmentation is of */
  const char* const* segment_names; /* segment_count of the parts; NULL: all */
  uint64_t segment_count;
  /* Of "igtl://HOST:PORT": */
  const char* image;     /* the images of this device name; NULL: of the first that comes */
  const char* transform; /* the transforms of this one move the volume; NULL: none do */
  double wait_s;         /* the first image is waited for so long; 0: 10 */
} PalSceneInfo;

/* Reads the data and prepares them, on all cores: takes from parts of a second to many seconds. Of
   a server whose first image does not come in time PAL_NO_DEVICE. [ANY] */
PAL_API PalResult pal_scene_open(PalContext* context, const PalSceneInfo* info, PalScene** scene);

/* Nulls *scene. Sessions that use it go on. [ANY] */
PAL_API PalResult pal_scene_close(PalScene** scene);

typedef enum PalSceneText {
  PAL_SCENE_TEXT_NOTES = 0,       /* what was chosen, and what was left out, a sentence per line */
  PAL_SCENE_TEXT_PLAN = 1,        /* what each haptic frame does, and what it leaves out and why */
  PAL_SCENE_TEXT_JSON = 2,        /* the scene in the format of docs/scene-file.md */
  PAL_SCENE_TEXT_MAX = 0x7fffffff /* no text: any number may be given, wrong ones are refused */
} PalSceneText;

/* Writes up to `capacity` bytes of a text, with its end, to `text` (NULL if capacity is 0) and the
   length of all of it, without its end, to *length. [ANY] */
PAL_API PalResult pal_scene_text(const PalScene* scene, PalSceneText which, char* text,
                                 size_t capacity, size_t* length);

typedef struct PalVolume {
  uint32_t size; /* sizeof(PalVolume), set before the call */
  uint32_t frame_count;
  double length_s;              /* of the sequence at rate 1 */
  double low_m[3], high_m[3];   /* its box, volume space */
  double world_from_volume[12]; /* at the start: three rows of four */
  uint32_t is_motion_known;     /* 0: it stands still until a session has found it */
  uint32_t is_movable;          /* by the host */
} PalVolume;

/* PAL_END after the last one. [ANY] */
PAL_API PalResult pal_scene_volume(const PalScene* scene, uint32_t index, PalVolume* volume);

/* What doing a recording again gave. */
typedef struct PalReplay {
  uint32_t size;       /* sizeof(PalReplay), set before the call */
  uint32_t is_cut_off; /* 1: the recording ends before its session did */
  uint64_t ticks;
  uint64_t different;      /* of them, ticks whose output is not the recorded one, bit by bit */
  int64_t first_different; /* the first of these; below 0: there is none */
} PalReplay;

/* Does a recording of this scene again (PalSessionInfo.recording, `palpate feel --record`), without
   a device, and compares every bit. `tubes`: all stream tubes that the hand released then are
   written there, as pal_session_save_tubes() does; NULL: not. PAL_BAD_INPUT if it is of another
   scene, damaged, or lost ticks. [ANY] */
PAL_API PalResult pal_scene_replay(const PalScene* scene, const char* recording, const char* tubes,
                                   PalReplay* replay);

/* ---- devices ----

   Haptic units: m, N, s, rad. Device space: x right, y up, z towards the user. */

typedef struct PalDeviceInfo {
  uint32_t size;                /* sizeof(PalDeviceInfo) */
  const char* name;             /* for people; NULL: "host" */
  double max_force_n;           /* it can give for a moment in every direction; more than 0 */
  double max_stiffness_n_per_m; /* that is stable; 0: not known */
  double workspace_centre_m[3];
  double workspace_radius_m; /* more than 0: forces fade at its end */
  double resolution_m;       /* of the position; 0: not known */
  double delay_s;            /* from taking a position to its force on the motors; 0: not known */
} PalDeviceInfo;

enum {
  PAL_FAULT_NONE = 0,
  PAL_FAULT_NOT_OPENED = 1,
  PAL_FAULT_UNPLUGGED = 2,
  PAL_FAULT_TIMEOUT = 3,
  PAL_FAULT_GARBAGE = 4,
  PAL_FAULT_NOT_HOMED = 5,
  PAL_FAULT_FORCE_OFF = 6
};

typedef struct PalReading {
  double position_m[3]; /* of the grip */
  int64_t time_ns;      /* CLOCK_MONOTONIC when it was taken; 0: now */
  uint32_t buttons;     /* bit k: button k is down */
  uint32_t fault;       /* PAL_FAULT_...; the position is not looked at unless it is 0 */
  uint32_t is_fresh;    /* 0: the position is the last one again */
} PalReading;

/* A force device of the host, for sessions with a haptic thread of palpate's. `exchange` is called
   about 1,000 times a second on that thread: it sends a force to the hand (N) and returns the
   newest position, within about a millisecond, without a lock that another thread may hold long.
   Both structures are copied; `exchange` and `user` must be valid until the session is closed. The
   last force is zero. */
typedef struct PalDevice {
  uint32_t size; /* sizeof(PalDevice) */
  const PalDeviceInfo* info;
  void (*exchange)(void* user, const double force_n[3], PalReading* reading);
  void* user;
} PalDevice;

/* ---- sessions ----

   A scene that is felt: haptic frames, poses, playing, and motion that is found meanwhile. */

typedef struct PalSession PalSession;

enum {
  /* The host calls pal_haptics_tick() in its own haptic loop; there is no haptic thread. */
  PAL_SESSION_HOST_TICKS = 1u << 0,
  /* Motion that nothing gives is not estimated: what has none stands still. */
  PAL_SESSION_NO_ESTIMATION = 1u << 1,
  /* The haptic thread does not ask for real-time priority, locked memory and awake cores. */
  PAL_SESSION_NO_REAL_TIME = 1u << 2,
  /* A button of the device must be held, or the force goes to zero. */
  PAL_SESSION_DEAD_MAN = 1u << 3,
  /* Of a live source every frame is followed, even where they repeat. Without it frames that repeat
     become a cycle with one motion for all of them, at the pace of those that come. */
  PAL_SESSION_FOLLOW = 1u << 4
};

typedef enum PalEventKind {
  PAL_EVENT_NOTE = 0,         /* something that a person may want to know */
  PAL_EVENT_MOVES = 1,        /* every step of the motion is known: the volumes begin to move */
  PAL_EVENT_WHOLE_MOTION = 2, /* one motion for a whole sequence is felt from now on */
  PAL_EVENT_MOTION_FAILED = 3 /* the sentence says why; what is known stays felt */
} PalEventKind;

typedef struct PalSessionInfo {
  uint32_t size;             /* sizeof(PalSessionInfo) */
  uint32_t flags;            /* PAL_SESSION_... */
  const PalDeviceInfo* host; /* PAL_SESSION_HOST_TICKS: the host's device */
  const PalDevice* device;   /* else: a device of the host's; NULL: one that palpate drives ... */
  const char* device_name;   /* ... as --device of the program has it: "falcon",
                                "haply@localhost:10001"; NULL: the first that answers; each has a
                                second for it. "simulated": a hand that is not there, see
                                simulated_path. "igtl://HOST:PORT": a tracked tool, whose tip is
                                where an OpenIGTLink server's transforms say in the patient space
                                of the first volume; it gives no force, and the scene's place of
                                the device does not count */
  double max_force_n;        /* 0: the scene's */
  double stiffness_n_per_m;  /* of the spring between hand and proxy; 0: the scene's */
  double watchdog_s;         /* ticks further apart bring the force down; 0: 0.005 */
  const char* preset;        /* of the estimation; NULL: "balanced", of a live source "fast" */
  /* Called with what happens, on the session's threads; must not close it. NULL: not called. */
  void (*on_event)(void* user, PalEventKind kind, const char* sentence);
  void* user;
  /* Every tick is recorded in this file, 1.1 GB per hour, until the session is closed: `palpate
     feel SCENE --replay FILE` gives the same forces bit by bit, where SCENE is one of files. The
     scene's motion must be known: what is found meanwhile is no part of a recording. NULL: nothing
     is recorded. */
  const char* recording;
  /* Bit k: button k of the device does what pal_session_ask_tubes() does: pressed, it lays a stream
     tube; again within half a second, it keeps them; held for a second, it clears them. 0: none. */
  uint32_t tube_buttons;
  /* Every tick is written as a row of this table, until the session is closed. NULL: none. */
  const char* csv;
  /* The ticks around a fault are written into this folder, which is made when there are some. NULL:
     nowhere. */
  const char* black_box;
  /* What is felt is sent to OpenIGTLink clients that connect to this port, from threads of low
     priority: where the proxy is and the force ten times a second, the moved volume and its motion
     at most twice; see docs/openigtlink.md. 0: nowhere. */
  uint64_t serve_port;
  /* Of the device "simulated": "press", "tap", "stroke", "circle", "sweep" or a file of
     t_s,x_m,y_m,z_m; NULL: "press". */
  const char* simulated_path;
  const char* simulated_hand; /* "human", "loose", "firm" or "none"; NULL: "human" */
  double lets_go_s;           /* the simulated hand lets go then; 0: never */
  /* Of the device "igtl://HOST:PORT": the transforms of this device name; NULL: of the first that
     come. */
  const char* tool;
} PalSessionInfo;

/* Starts. The force begins at zero and comes in over two seconds. [ANY] */
PAL_API PalResult pal_session_open(PalScene* scene, const PalSessionInfo* info,
                                   PalSession** session);

/* Ramps the force to zero and waits for that, at most 0.6 s, then ends all threads of the session
   and nulls *session. A session that its host ticks is ended at once: call pal_session_stop()
   first, go on ticking until pal_session_at_rest(), then close. Its views go on
   showing the last state. An error only where a recording or a table could not be written; the
   session is closed then, too. [ANY] */
PAL_API PalResult pal_session_close(PalSession** session);

/* The force goes to zero by a ramp, for good; waits for it where the haptic thread is palpate's. No
   live frame is taken any more, and nothing is served. [ANY] */
PAL_API PalResult pal_session_stop(PalSession* session);
/* 1: it was stopped, and the force has been zero since. [ANY] */
PAL_API int pal_session_at_rest(const PalSession* session);

typedef struct PalTick {
  double position_m[3]; /* of the grip */
  int64_t time_ns;      /* when it was taken, by a clock that runs evenly; 0: now */
  uint32_t buttons;     /* bit k: button k is down */
} PalTick;

/* One haptic frame: the force on the hand, N. 250 to 4,000 times a second, by one thread at a time.
   Zero, and PAL_BAD_INPUT, if the session is not one that its host ticks. A position that is not
   finite, or a time that does not rise, is taken for a fault of the device: the force ramps to
   zero, and comes back when the hand has been free. [RT] */
PAL_API PalResult pal_haptics_tick(PalSession* session, const PalTick* tick, double force_n[3]);

enum { PAL_MOST_VOLUMES = 8 };

/* The newest haptic frame. */
typedef struct PalState {
  uint32_t size; /* sizeof(PalState), set before the call */
  uint32_t in_contact;
  int64_t time_ns;              /* of the frame; 0: there was none yet */
  double hand_m[3], proxy_m[3]; /* world */
  double force_n[3];            /* on the hand, along the world's axes */
  const char* cause; /* why the force is not the scene's, in a word ("late"), or ""; static */
  const char* cause_sentence;  /* the same for people; static */
  uint32_t can_play;           /* 0: motion is awaited */
  uint32_t steps, steps_known; /* of the motion that is found meanwhile */
  uint32_t volume_count;
  struct {
    double world_from_volume[12];
    double time_s; /* of its sequence */
    double rate;   /* it plays with, s per s */
  } volumes[PAL_MOST_VOLUMES];
  uint64_t ticks, late_ticks; /* so far; late: by the watchdog */
  /* Of a live source: frames that came, and those that were felt, which is after `frame_delay_s`
     (s, the median) from when they came. While they repeat and a cycle of them is felt, its length;
     else 0. */
  uint64_t frames_received, frames_felt;
  double frame_delay_s, frame_cycle_s;
} PalState;

/* Waits for nothing but another thread in this very call. [ANY] */
PAL_API PalResult pal_session_state(PalSession* session, PalState* state);

/* A volume of the scene as it is in the newest haptic frame. */
typedef struct PalVolumeState {
  uint32_t size;                /* sizeof(PalVolumeState), set before the call */
  uint32_t reserved;            /* 0 */
  double world_from_volume[12]; /* three rows of four */
  double time_s;                /* of its sequence */
  double rate;                  /* it plays with, s per s */
} PalVolumeState;

/* The same as in PalState.volumes, which can not grow. PAL_NOT_YET before the first haptic frame,
   PAL_END after the last volume. Waits as pal_session_state() does. [ANY] */
PAL_API PalResult pal_session_volume(PalSession* session, uint32_t index, PalVolumeState* volume);

/* The next frame of a scene with PAL_SCENE_LIVE. The material is taken along from the frame that is
   felt to the newest one: a motion is estimated for each, which takes some tenths of a second, and
   frames that come meanwhile are left out but for the last. grid: where it lies; NULL: where the
   first one does. Another grid is resampled onto that of the first frame; a frame that lies all
   elsewhere is left out, and an event of kind PAL_EVENT_NOTE says so. time_ns: CLOCK_MONOTONIC when
   it was taken, from which delays and cycles are counted; 0: now. The samples are read during the
   call. Frames are felt in the order of these calls: give them from one thread. [ANY] */
PAL_API PalResult pal_session_push_frame(PalSession* session, const PalGrid* grid,
                                         PalSampleType type, const void* samples, int64_t time_ns);

/* Plays or pauses; PAL_NOT_YET while motion is awaited. Both are ramps. [ANY] */
PAL_API PalResult pal_session_play(PalSession* session, int on);
/* To a time of every moving volume's sequence, as a share of its length, 0 to 1; pauses. [ANY] */
PAL_API PalResult pal_session_scrub(PalSession* session, double share);
/* Mode `index` of the scene: on or off, and a factor on its strengths, by a ramp. Both or, with
   PAL_NOT_YET, neither. [ANY] */
PAL_API PalResult pal_session_set_mode(PalSession* session, uint32_t index, int on, double gain);
/* Where a movable volume is now: a rotation with equal or unequal scales along its axes, and a
   translation, three rows of four. It goes there on a smooth path: once per picture is enough.
   [ANY] */
PAL_API PalResult pal_session_place(PalSession* session, uint32_t volume,
                                    const double world_from_volume[12]);
/* After a cause that stays ("the force is off until ...") : begin again. [ANY] */
PAL_API PalResult pal_session_rearm(PalSession* session);

/* ---- stream tubes ----

   A stream tube is the field line through the place where the proxy was at one instant, of the
   field that is felt: vectors, or the gradient that guides; where there is neither, the velocity of
   the moving material. From then on it is material and goes with the motion. pal_view_render()
   draws them. At most 64; then the oldest that is not kept goes. */

typedef enum PalTubesAction {
  PAL_TUBES_RELEASE = 0,     /* a tube through the proxy of the next tick */
  PAL_TUBES_KEEP = 1,        /* those that are there stay when the others are cleared */
  PAL_TUBES_CLEAR = 2,       /* those that are not kept go; all of them if all are kept */
  PAL_TUBES_MAX = 0x7fffffff /* no action: any number may be given, wrong ones are refused */
} PalTubesAction;

/* Done with the next tick, and known some hundredths of a second later. Where there is no field at
   the proxy, an event of kind PAL_EVENT_NOTE says why. PAL_NOT_YET: too much waits already. [ANY]
 */
PAL_API PalResult pal_session_ask_tubes(PalSession* session, PalTubesAction action);

typedef enum PalTubeField {
  PAL_TUBE_VECTORS = 0,
  PAL_TUBE_GRADIENT = 1,
  PAL_TUBE_CURL = 2,
  PAL_TUBE_VELOCITY = 3
} PalTubeField;

/* A stream tube as it is at the newest tick. */
typedef struct PalTube {
  uint32_t size;   /* sizeof(PalTube), set before the call */
  uint32_t volume; /* of the scene, through which it runs */
  uint32_t is_kept;
  uint32_t is_closed; /* its last point is its first */
  PalTubeField field; /* that it followed */
  uint32_t point_count;
  uint32_t seed_point; /* which of them was at the proxy */
  /* Room for so many points, set before the call; of more points the first ones are given. */
  uint32_t capacity;
  double* points_m; /* 3 * capacity numbers, world, in order along the tube; NULL: not wanted */
  /* capacity numbers: the length of the field's vector at each point when the tube was laid; NULL:
     not wanted. */
  double* lengths;
  const char* length_unit; /* "data", "data per m" or "m/s"; static */
} PalTube;

/* Tube `index`, the oldest first; PAL_END after the last one. They are others after each action: a
   point_count from an earlier call is only a guess, which point_count of this one corrects. [ANY]
 */
PAL_API PalResult pal_session_tube(PalSession* session, uint32_t index, PalTube* tube);

/* Writes all tubes as lines for ParaView and 3D Slicer (.vtk, mm, LPS), where they were laid, with
   the way of each point to the first frame. All of the file or none; PAL_BAD_OUTPUT. [ANY] */
PAL_API PalResult pal_session_save_tubes(PalSession* session, const char* path);

/* ---- views ----

   Pictures of what is felt, by the context's device. */

typedef struct PalView PalView;

enum {
  PAL_VIEW_NO_HAND = 1u << 0, /* without pen, proxy and force */
  PAL_VIEW_NO_BOX =
      1u << 1, /* without the edges of the data and the letters of the patient's sides */
  PAL_VIEW_CUT_OPEN = 1u << 2 /* what lies towards the eye is cut away, through what is touched */
};

typedef struct PalViewInfo {
  uint32_t size;          /* sizeof(PalViewInfo) */
  uint32_t flags;         /* PAL_VIEW_... */
  uint32_t width, height; /* of an eye's largest picture */
  uint32_t eye_count;     /* at most: 1 or 2 */
  /* A transfer function, as --look of the program has it; NULL: what suits the data. */
  const char* look;
} PalViewInfo;

/* Uploads the data: off the picture loop. [ANY] */
PAL_API PalResult pal_view_open(PalSession* session, const PalViewInfo* info, PalView** view);
/* Waits for the picture in the making; nulls *view. [ANY] */
PAL_API PalResult pal_view_close(PalView** view);

/* As OpenXR has it. */
typedef struct PalEye {
  double position_m[3];  /* world */
  double orientation[4]; /* world from eye, a unit quaternion x, y, z, w; it looks along its -z, y
                            up */
  /* Tangents of the angles of view; left and down are below 0. */
  double tan_left, tan_right, tan_down, tan_up;
} PalEye;

/* The host's images for a picture, of the device that the context shares with it: what the host has
   drawn there hides what lies behind, and is seen through what lies before. One sample, as large as
   the picture, made for transfers from and to them. Handles and enumerations are Vulkan's (VkImage,
   VkFormat, VkImageLayout). */
typedef struct PalImages {
  uint32_t size;                /* sizeof(PalImages) */
  uint32_t writes_depth;        /* 1: the depth goes there where a volume takes half of the light */
  uint64_t colour[2], depth[2]; /* VkImage per eye; depth 0: all of the host's is behind */
  uint32_t colour_layer[2], depth_layer[2];
  /* R8G8B8A8 or B8G8R8A8, _UNORM or _SRGB; D32_SFLOAT, D32_SFLOAT_S8_UINT, X8_D24_UNORM_PACK32 or
     D24_UNORM_S8_UINT. */
  uint32_t colour_format, depth_format;
  uint32_t colour_layout, depth_layout;    /* in which they are and are left */
  double inverse_depth_0, inverse_depth_1; /* 1/m: 1 / z where the depth is 0 and 1 */
} PalImages;

/* Submits a picture of the session as it will be `ahead_s` seconds from now, and does not wait for
   it. With images: into these, on the shared queue after what the host has submitted and before
   what it submits next. Without: for pal_view_read(). One thread at a time. */
PAL_API PalResult pal_view_render(PalView* view, const PalEye* eyes, uint32_t eye_count,
                                  uint32_t width, uint32_t height, double ahead_s,
                                  const PalImages* images);
/* Waits for the last picture. One thread at a time. */
PAL_API PalResult pal_view_wait(PalView* view);
/* The last picture of an eye: width * height pixels, rows from the top, R in the lowest byte, then
   G, B (sRGB) and how much is covered; depths along the eye's axis, m, 0 where nothing is. Either
   may be NULL. One thread at a time. */
PAL_API PalResult pal_view_read(PalView* view, uint32_t eye, uint32_t* rgba, float* depth_m);

#ifdef __cplusplus
}
#endif

#endif /* PALPATE_H */
