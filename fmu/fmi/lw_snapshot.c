/* States of an instance that the environment may keep, restore, and carry to another process.
 *
 * A handle is known by the instance that made it, so that a freed or foreign one is refused. In memory and
 * in bytes a state is the same list of doubles. The bytes, little-endian: "LWFMU", two zeros, a version; the
 * model (FNV-1a hash of its token, 8); the number of doubles (4); a CRC-32 of all other bytes (4); the
 * doubles.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "lw_part.h"

struct lw_snapshot {
    lw_snapshot *next;
    double data[];
};

enum { KIND, MODE, TIME, STOPS, STOP, INTEGERS, HEAD = INTEGERS + LW_INTEGERS };
enum { HEADER = 24, CRC_AT = 20 };
static const unsigned char magic[8] = {'L', 'W', 'F', 'M', 'U', 0, 0, 1};

static size_t length(const lw_instance *instance) { return HEAD + instance->state_count; }

/* ---- handles ---- */

/* Where the list holds the handle; NULL if it does not. */
static lw_snapshot **find(lw_instance *instance, const void *handle) {
    lw_snapshot **link = &instance->snapshots;
    while (*link && *link != handle) link = &(*link)->next;
    return *link ? link : NULL;
}

static lw_snapshot *known(lw_instance *instance, const void *handle) {
    lw_snapshot **link = handle ? find(instance, handle) : NULL;
    if (!link)
        lw_report(instance, LW_FMI_ERROR, "Expected a state that this instance has returned but was %s.",
                  handle ? "a freed or foreign one" : "NULL");
    return link ? *link : NULL;
}

static lw_snapshot *add(lw_instance *instance) {
    lw_snapshot *snapshot = malloc(sizeof *snapshot + length(instance) * sizeof(double));
    if (!snapshot) {
        lw_report(instance, LW_FMI_ERROR, "Expected memory for a state but was none left.");
        return NULL;
    }
    snapshot->next = instance->snapshots;
    instance->snapshots = snapshot;
    return snapshot;
}

int lw_get_snapshot(lw_instance *instance, void **handle) {
    if (!handle) return lw_missing(instance, "FMUState");
    lw_snapshot *snapshot = *handle ? known(instance, *handle) : add(instance);
    if (!snapshot) return LW_FMI_ERROR;
    double *data = snapshot->data;
    int stops = instance->stop < HUGE_VAL;
    data[KIND] = instance->kind;
    data[MODE] = instance->mode;
    data[TIME] = instance->time;
    data[STOPS] = stops;
    data[STOP] = stops ? instance->stop : 0.0;
    for (int i = 0; i < LW_INTEGERS; ++i) data[INTEGERS + i] = instance->integers[i];
    memcpy(data + HEAD, instance->store, instance->state_count * sizeof(double));
    *handle = snapshot;
    return LW_FMI_OK;
}

int lw_set_snapshot(lw_instance *instance, void *handle) {
    lw_snapshot *snapshot = known(instance, handle);
    if (!snapshot) return LW_FMI_ERROR;
    const double *data = snapshot->data, *known_values = data + HEAD + lw_part_memory();
    size_t parameters = lw_part_inputs(instance) * sizeof(double);
    instance->unconfigured |= memcmp(instance->values, known_values, parameters) != 0;
    instance->mode = (unsigned)data[MODE];
    instance->time = data[TIME];
    instance->stop = data[STOPS] != 0.0 ? data[STOP] : HUGE_VAL;
    for (int i = 0; i < LW_INTEGERS; ++i) {
        instance->unconfigured |= instance->integers[i] != (int32_t)data[INTEGERS + i];
        instance->integers[i] = (int32_t)data[INTEGERS + i];
    }
    memcpy(instance->store, data + HEAD, instance->state_count * sizeof(double));
    instance->stale = LW_STALE_ALL;
    return LW_FMI_OK;
}

int lw_free_snapshot(lw_instance *instance, void **handle) {
    if (!handle || !*handle) return LW_FMI_OK;
    lw_snapshot *snapshot = known(instance, *handle);
    if (!snapshot) return LW_FMI_ERROR;
    *find(instance, snapshot) = snapshot->next;
    free(snapshot);
    *handle = NULL;
    return LW_FMI_OK;
}

void lw_free_snapshots(lw_instance *instance) {
    while (instance->snapshots) {
        lw_snapshot *first = instance->snapshots;
        instance->snapshots = first->next;
        free(first);
    }
}

/* ---- bytes ---- */

static void put(unsigned char *bytes, uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes[i] = (unsigned char)(value >> 8 * i & 0xff);
}

static uint64_t take(const unsigned char *bytes, int count) {
    uint64_t value = 0;
    for (int i = count - 1; i >= 0; --i) value = value << 8 | bytes[i];
    return value;
}

static uint64_t model_hash(void) {
    uint64_t hash = 0xcbf29ce484222325u;
    for (const char *c = lw_fmu_token; *c; ++c) hash = (hash ^ (unsigned char)*c) * 0x100000001b3u;
    return hash;
}

/* CRC-32 of IEEE 802.3, four bits at a time. */
static uint32_t crc(uint32_t sum, const unsigned char *bytes, size_t count) {
    static const uint32_t table[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
                                       0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                       0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    sum = ~sum;
    for (size_t i = 0; i < count; ++i) {
        sum ^= bytes[i];
        sum = table[sum & 15] ^ sum >> 4;
        sum = table[sum & 15] ^ sum >> 4;
    }
    return ~sum;
}

static uint32_t checksum(const unsigned char *bytes, size_t size) {
    return crc(crc(0, bytes, CRC_AT), bytes + HEADER, size - HEADER);
}

static size_t bytes_of(const lw_instance *instance) { return HEADER + 8 * length(instance); }

int lw_serialized_size(lw_instance *instance, void *handle, size_t *size) {
    if (!known(instance, handle)) return LW_FMI_ERROR;
    if (!size) return lw_missing(instance, "size");
    *size = bytes_of(instance);
    return LW_FMI_OK;
}

int lw_serialize(lw_instance *instance, void *handle, unsigned char *bytes, size_t size) {
    const lw_snapshot *snapshot = known(instance, handle);
    if (!snapshot) return LW_FMI_ERROR;
    if (!bytes) return lw_missing(instance, "serializedState");
    if (size != bytes_of(instance))
        return lw_report(instance, LW_FMI_ERROR, "Expected %lu bytes but was %lu.",
                         (unsigned long)bytes_of(instance), (unsigned long)size);
    memcpy(bytes, magic, sizeof magic);
    put(bytes + 8, model_hash(), 8);
    put(bytes + 16, length(instance), 4);
    for (size_t i = 0; i < length(instance); ++i) {
        uint64_t bits;
        memcpy(&bits, &snapshot->data[i], sizeof bits);
        put(bytes + HEADER + 8 * i, bits, 8);
    }
    put(bytes + CRC_AT, checksum(bytes, size), 4);
    return LW_FMI_OK;
}

/* ---- back from bytes ---- */

/* What is wrong with the frame of the bytes; NULL for nothing. */
static const char *flaw_of_bytes(const lw_instance *instance, const unsigned char *bytes, size_t size) {
    if (size < HEADER || memcmp(bytes, magic, 5)) return "other bytes";
    if (memcmp(bytes, magic, sizeof magic)) return "one of another version";
    if (take(bytes + 8, 8) != model_hash()) return "one of another model";
    if (size != bytes_of(instance) || take(bytes + 16, 4) != length(instance)) return "one of another length";
    if (take(bytes + CRC_AT, 4) != checksum(bytes, size)) return "damaged";
    return NULL;
}

static int is_int32(double value) {
    return value >= -2147483648.0 && value <= 2147483647.0 && value == floor(value);
}

static int is_mode(double value, int kind) {
    switch (is_int32(value) ? (int32_t)value : 0) {
    case LW_INSTANTIATED:
    case LW_INITIALIZATION:
    case LW_TERMINATED: return 1;
    case LW_STEP: return kind == LW_CO_SIMULATION;
    case LW_EVENT:
    case LW_CONTINUOUS: return kind == LW_MODEL_EXCHANGE;
    default: return 0;
    }
}

static const char *flaw_of_data(const lw_instance *instance, const double *data) {
    for (size_t i = 0; i < length(instance); ++i)
        if (!isfinite(data[i])) return "one with numbers that are not finite";
    if (data[KIND] != instance->kind) return "one of another interface type";
    if (!is_mode(data[MODE], instance->kind)) return "one in an unknown mode";
    for (int i = 0; i < LW_INTEGERS; ++i)
        if (!is_int32(data[INTEGERS + i])) return "one with broken integers";
    return NULL;
}

int lw_deserialize(lw_instance *instance, const unsigned char *bytes, size_t size, void **handle) {
    if (!bytes || !handle) return lw_missing(instance, bytes ? "FMUState" : "serializedState");
    const char *flaw = flaw_of_bytes(instance, bytes, size);
    void *made = NULL;
    if (!flaw) {
        lw_snapshot *snapshot = made = add(instance);
        if (!snapshot) return LW_FMI_ERROR;
        for (size_t i = 0; i < length(instance); ++i) {
            uint64_t bits = take(bytes + HEADER + 8 * i, 8);
            memcpy(&snapshot->data[i], &bits, sizeof bits);
        }
        flaw = flaw_of_data(instance, snapshot->data);
        if (flaw) lw_free_snapshot(instance, &made);
    }
    if (flaw) return lw_report(instance, LW_FMI_ERROR, "Expected a state of this model but was %s.", flaw);
    *handle = made;
    return LW_FMI_OK;
}
