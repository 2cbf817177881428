"""Flight logs whose instances, frames or flags decide: tests/data/field-2/streams. One straight flight in all of them, at (7.5, 13, -1) m/s
north, east, down from 30 m above the origin (47.05 N, 8.31 E, 480 m), for 3 s; roll 5, pitch 2, yaw 60 degrees. What must not be flown is
40 m off.

    (packages of flight_logs.py) && python scripts/goldens/flight_streams.py
"""
import pathlib
import struct

import numpy as np
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer as Ros2Writer
from pymavlink import DFReader
from pymavlink.quaternion import Quaternion
from pyulog import ULog

OUT = pathlib.Path(__file__).parents[2] / "tests/data/field-2/streams"
ORIGIN = (47.05, 8.31, 450.0)
ANGLES = np.radians([5.0, 2.0, 60.0])
VELOCITY = np.array([7.5, 13.0, -1.0])
START_S = 1683195600
PER_DEG = 0.011131884502145034 * 1e7
# Columns are x, y, z in forward-right-down, or north-east-down.
AXES = {
    "frd": np.eye(3), "flu": np.diag([1.0, -1.0, -1.0]), "rdf": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]),
    "ned": np.eye(3), "enu": np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1.0]]), "nwu": np.diag([1.0, -1.0, -1.0]),
}


def times(hz=10, seconds=3.0):
    return np.arange(round(seconds * hz) + 1) / hz


def ned(t):
    return np.array([0.0, 0.0, -30.0]) + VELOCITY * t


def attitude():
    """Takes forward-right-down to north-east-down."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(ANGLES), np.sin(ANGLES)
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1.0]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return about_z @ about_y @ about_x


def xyzw(matrix):
    w, x, y, z = Quaternion(matrix).q
    return x, y, z, w


def pose(world, body, t):
    """Position and quaternion in other axes."""
    to_world, from_body = AXES[world].T, AXES[body]
    return to_world @ ned(t), xyzw(to_world @ attitude() @ from_body)


PARTS = {
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n", "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z\n", "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
    "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose\nfloat64[36] covariance\n",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist\nfloat64[36] covariance\n",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n",
    "geometry_msgs/TransformStamped": "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n",
    "sensor_msgs/NavSatStatus": "int8 status\nuint16 service\n",
}
KINDS = {
    "geometry_msgs/msg/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose\n",
    "nav_msgs/msg/Odometry": "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
                             "geometry_msgs/TwistWithCovariance twist\n",
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n",
    "sensor_msgs/msg/NavSatFix": "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\n"
                                 "float64 altitude\nfloat64[9] position_covariance\nuint8 position_covariance_type\n",
    "sensor_msgs/msg/Imu": "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
                           "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
                           "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
}


def header(t, frame):
    return {"stamp": {"sec": START_S + int(t), "nanosec": round(t % 1 * 1e9)}, "frame_id": frame}


def posed(position, quaternion, names=("position", "orientation")):
    return {names[0]: dict(zip("xyz", map(float, position))), names[1]: dict(zip("xyzw", map(float, quaternion)))}


def pose_stamped(t, frame, world="enu", body="flu"):
    return "geometry_msgs/msg/PoseStamped", {"header": header(t, frame), "pose": posed(*pose(world, body, t))}


def odometry(t, frame, child, world="enu", body="flu", shift=0.0):
    position, quaternion = pose(world, body, t)
    zeros = [0.0] * 36
    return "nav_msgs/msg/Odometry", {
        "header": header(t, frame), "child_frame_id": child,
        "pose": {"pose": posed(position + shift, quaternion), "covariance": zeros},
        "twist": {"twist": {"linear": {"x": 0.0, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.0}}, "covariance": zeros}}


def transforms(*items):
    return "tf2_msgs/msg/TFMessage", {"transforms": [
        {"header": header(t, parent), "child_frame_id": child, "transform": posed(position, quaternion, ("translation", "rotation"))}
        for t, parent, child, position, quaternion in items]}


def fix(t, status=0):
    north, east, down = ned(t)
    latitude = ORIGIN[0] + north / PER_DEG
    return "sensor_msgs/msg/NavSatFix", {
        "header": header(t, "gps"), "status": {"status": status, "service": 1}, "latitude": latitude,
        "longitude": ORIGIN[1] + east / PER_DEG / np.cos(np.radians((latitude + ORIGIN[0]) / 2)), "altitude": 450.0 - down,
        "position_covariance": [0.0] * 9, "position_covariance_type": 0}


def imu(t, frame, world, body):
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    return "sensor_msgs/msg/Imu", {
        "header": header(t, frame), "orientation": dict(zip("xyzw", map(float, pose(world, body, t)[1]))),
        "orientation_covariance": [0.0] * 9, "angular_velocity": zero, "angular_velocity_covariance": [0.0] * 9,
        "linear_acceleration": zero, "linear_acceleration_covariance": [0.0] * 9}


def bag(name, topics):
    """An MCAP file of {topic: function of a time, or a list of (time, message)}."""
    rest = "".join("=" * 80 + f"\nMSG: {part}\n{text}" for part, text in PARTS.items())
    with open(OUT / name, "wb") as file:
        writer = Ros2Writer(file, compression=CompressionType.ZSTD)
        schemas = {}
        messages = []
        for topic, source in topics.items():
            stamped = source if isinstance(source, list) else [(t, source(t)) for t in times()]
            messages += [(t, topic, message) for t, message in stamped]
        for t, topic, (kind, message) in sorted(messages, key=lambda item: item[0]):
            if kind not in schemas:
                schemas[kind] = writer.register_msgdef(kind, KINDS[kind] + rest)
            at = int((START_S + 0.01 + t) * 1e9)
            writer.write_message(topic, schemas[kind], message, log_time=at, publish_time=at)
        writer.finish()


def bags():
    left = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    position = np.array([100.0, 50.0, 0.0])

    def in_odom(t, at=position):
        """Pose of the body in `odom`, which lies in `map` at a position, turned left by 90 degrees."""
        matrix = AXES["enu"].T @ attitude() @ AXES["flu"]
        return left.T @ (AXES["enu"].T @ ned(t) - at), xyzw(left.T @ matrix)

    bag("pose_local_origin_ned.mcap", {"/pose": lambda t: pose_stamped(t, "local_origin_ned", "ned", "frd")})
    bag("odom_ned_of_flu.mcap", {"/odom": lambda t: odometry(t, "odom_ned", "base_link", "ned", "flu")})
    bag("odom_of_fcu_frd.mcap", {"/odom": lambda t: odometry(t, "/odom", "/fcu_frd", "enu", "frd")})
    bag("map_nwu.mcap", {"/odom": lambda t: odometry(t, "map_nwu", "base_link", "nwu", "flu")})
    bag("airsim.mcap", {"/odom": lambda t: odometry(t, "world_ned", "drone_1/odom_local_ned", "ned", "frd")})
    bag("cam0_optical.mcap", {"/vo": lambda t: odometry(t, "map_ned", "cam0_optical", "ned", "rdf")})
    bag("pose_in_base_link.mcap", {"/pose": lambda t: pose_stamped(t, "base_link")})
    bag("pose_in_earth.mcap", {"/pose": lambda t: pose_stamped(t, "earth")})
    bag("frame_changes.mcap", {"/pose": lambda t: pose_stamped(t, "odom" if t < 1.5 else "map")})
    bag("two_children.mcap", {"/odom": [
        (t, odometry(t, "odom", child, shift=shift)) for t in times() for child, shift in (("base_link", 0.0), ("payload", 40.0))]})
    quarter = xyzw(left)
    bag("tf_static_parent.mcap", {
        "/tf_static": [(1.0, transforms((1.0, "map", "odom", position, quarter)))],
        "/tf": lambda t: transforms((t, "odom", "base_link", *in_odom(t)))})
    # The parent moves by 2 m/s, and is sent once a second.
    moving = lambda t: position + np.array([2.0 * t, 0.0, 0.0])
    bag("tf_moving_parent.mcap", {"/tf": [
        (t, transforms((t, "odom", "base_link", *in_odom(t, moving(t))),
                       *([(t, "map", "odom", moving(t), quarter)] if t % 1 == 0 else []))) for t in times()]})
    bag("odom_below_map.mcap", {
        "/odom": lambda t: odometry(t, "odom", "base_link"),
        "/tf": lambda t: transforms((t, "odom", "base_link", *pose("enu", "flu", t)), (t, "map", "odom", position, quarter))})
    # Two vehicles whose frames have the same names.
    bag("two_vehicles.mcap", {f"/uav{number}/tf": lambda t, at=at: transforms((t, "odom", "base_link", *in_odom(t, at)), (t, "map", "odom", position, quarter))
                              for number, at in ((1, position), (2, position + 40.0))})
    # A sensor that is turned on the vehicle.
    bag("imu_mount.mcap", {
        "/fix": fix, "/imu": lambda t: imu(t, "imu_link", "enu", "flu"),
        "/tf_static": [(0.0, transforms((0.0, "base_link", "imu_link", np.array([0.1, 0, 0]), quarter)))]})
    # mavros: axes turned about in the transforms; `map` and `odom` are one.
    swap = xyzw(AXES["enu"].T)
    bag("mavros_axes.mcap", {
        "/odom": lambda t: odometry(t, "odom_ned", "base_link_frd", "ned", "frd"),
        "/tf_static": [(0.0, transforms((0.0, "odom", "odom_ned", np.zeros(3), swap), (0.0, "map", "odom", np.zeros(3), (0, 0, 0, 1)),
                                        (0.0, "base_link", "base_link_frd", np.zeros(3), (1, 0, 0, 0))))]})
    bag("fix_imu_ned.mcap", {
        "/fix": lambda t: fix(t, -1 if 0.95 < t < 1.25 else 0), "/imu": lambda t: imu(t, "imu_link_ned", "ned", "frd")})


class Dataflash:
    def __init__(self):
        self.data, self.formats = b"", {}
        self.define(128, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns")

    def define(self, kind, name, letters, columns):
        length = 3 + sum(struct.calcsize("<" + DFReader.FORMAT_TO_STRUCT[letter][0]) for letter in letters)
        self.formats[name] = DFReader.DFFormat(kind, name, length, letters, columns)
        self.data += struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 128, kind, length, name.encode(), letters.encode(), columns.encode())

    def write(self, name, *values):
        fmt = self.formats[name]
        scaled = [v / m if m else v for v, m in zip(values, fmt.msg_mults)]
        packed = [v if isinstance(v, bytes) or f in "fdg" else round(v) for v, f in zip(scaled, fmt.format)]
        self.data += DFReader.DFMessage(fmt, packed, True, None).get_msgbuf()

    def save(self, name):
        (OUT / name).write_bytes(self.data)
        log = DFReader.DFReader_binary(str(OUT / name))
        count = 0
        while log.recv_msg() is not None:
            count += 1
        assert count > 60, name


ROLL, PITCH, YAW = np.degrees(ANGLES)
FILTER = "TimeUS,Roll,Pitch,Yaw,PN,PE,PD"


def at(t, off):
    """Latitude, longitude, height, with an offset to the north."""
    north, east, down = ned(t)
    latitude = ORIGIN[0] + (north + off) / PER_DEG
    return latitude, ORIGIN[1] + east / PER_DEG / np.cos(np.radians((latitude + ORIGIN[0]) / 2)), ORIGIN[2] - down


def ardupilot():
    # Filters of old firmwares: a message for each core. Core 1 flies from 1.5 s.
    log = Dataflash()
    for kind, name in ((20, "NKF1"), (21, "NKF6")):
        log.define(kind, name, "QccCfff", FILTER)
    log.define(22, "NKF4", "Qb", "TimeUS,PI")
    log.define(23, "ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt")
    log.write("ORGN", 1_900_000, 0, *ORIGIN)
    for t in times():
        us, primary = round(t * 1e6) + 2_000_000, int(t > 1.45)
        for core, name in enumerate(("NKF1", "NKF6")):
            off = 0.0 if core == primary else 40.0
            log.write(name, us, ROLL, PITCH, YAW, *(ned(t) + [off, 0, 0]))
        log.write("NKF4", us, primary)
    log.save("nkf_old_cores.bin")

    # Two cores, and nothing says which flies; AHR2, which stands by, is 40 m off.
    log = Dataflash()
    log.define(20, "XKF1", "QBccCfff", "TimeUS,C,Roll,Pitch,Yaw,PN,PE,PD")
    log.define(21, "AHR2", "QccCfLL", "TimeUS,Roll,Pitch,Yaw,Alt,Lat,Lng")
    log.define(23, "ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt")
    log.write("ORGN", 1_900_000, 0, *ORIGIN)
    for t in times():
        us = round(t * 1e6) + 2_000_000
        for core in range(2):
            log.write("XKF1", us, core, ROLL, PITCH, YAW, *(ned(t) + [40.0 * core, 0, 0]))
        lat, lon, height = at(t, 40.0)
        log.write("AHR2", us, ROLL, PITCH, YAW, height, lat, lon)
    log.save("xkf_no_primary.bin")

    # Core 1 of three flies throughout.
    log = Dataflash()
    log.define(20, "XKF1", "QBccCfff", "TimeUS,C,Roll,Pitch,Yaw,PN,PE,PD")
    log.define(21, "XKF4", "QBb", "TimeUS,C,PI")
    log.define(23, "ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt")
    log.write("ORGN", 1_900_000, 0, *ORIGIN)
    for t in times():
        us = round(t * 1e6) + 2_000_000
        for core in range(3):
            log.write("XKF1", us, core, ROLL, PITCH, YAW, *(ned(t) + [0.0 if core == 1 else 40.0, 0, 0]))
            log.write("XKF4", us, core, 1)
    log.save("xkf_core_1.bin")

    # Both filters; the parameter says that the second kind flies.
    log = Dataflash()
    for kind, name in ((20, "XKF1"), (21, "NKF1")):
        log.define(kind, name, "QBccCfff", "TimeUS,C,Roll,Pitch,Yaw,PN,PE,PD")
    log.define(22, "PARM", "QNf", "TimeUS,Name,Value")
    log.define(23, "ORGN", "QBLLe", "TimeUS,Type,Lat,Lng,Alt")
    log.write("PARM", 1_000_000, b"AHRS_EKF_TYPE", 2.0)
    log.write("ORGN", 1_900_000, 0, *ORIGIN)
    for t in times():
        us = round(t * 1e6) + 2_000_000
        for name, off in (("XKF1", 40.0), ("NKF1", 0.0)):
            log.write(name, us, 0, ROLL, PITCH, YAW, *(ned(t) + [off, 0, 0]))
    log.save("ekf_type_2.bin")

    # Two receivers without a flag of use; the first never has a fix.
    log = Dataflash()
    log.define(20, "GPS", "QBBIHLLe", "TimeUS,I,Status,GMS,GWk,Lat,Lng,Alt")
    log.define(22, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    for t in times():
        us = round(t * 1e6) + 2_000_000
        log.write("ATT", us, ROLL, PITCH, YAW)
        for receiver in range(2):
            log.write("GPS", us, receiver, 3 if receiver else 1, 122_418_000 + round(t * 1e3), 2260, *at(t, 0.0 if receiver else 40.0))
    log.save("gps_no_fix.bin")

    # Two receivers with a flag of use, in one message; the second from 1.5 s. Then the same in two messages.
    for name, separate in (("gps_used.bin", False), ("gps2_used.bin", True)):
        log = Dataflash()
        if separate:
            for kind, message in ((20, "GPS"), (21, "GPS2")):
                log.define(kind, message, "QBIHLLeB", "TimeUS,Status,GMS,GWk,Lat,Lng,Alt,U")
        else:
            log.define(20, "GPS", "QBBIHLLeB", "TimeUS,I,Status,GMS,GWk,Lat,Lng,Alt,U")
        log.define(22, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
        for t in times():
            us = round(t * 1e6) + 2_000_000
            log.write("ATT", us, ROLL, PITCH, YAW)
            for receiver in range(2):
                used = receiver == int(t > 1.45)
                values = (3, 122_418_000 + round(t * 1e3), 2260, *at(t, 0.0 if used else 40.0), int(used))
                if separate:
                    log.write("GPS2" if receiver else "GPS", us, *values)
                else:
                    log.write("GPS", us, receiver, *values)
        log.save(name)


def ulog(name, formats, topics, samples):
    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000) + message("B", bytes(40))
    for text in formats:
        data += message("F", text.encode())
    for index, (topic, instance) in enumerate(topics):
        data += message("A", struct.pack("<BH", instance, index) + topic.encode())
    for _, index, body in sorted(samples, key=lambda sample: sample[0]):
        data += message("D", struct.pack("<H", index) + body)
    (OUT / name).write_bytes(data)
    assert len(ULog(str(OUT / name)).data_list) == len(topics), name


def px4():
    us = lambda t: round(t * 1e6) + 2_000_000
    x, y, z, w = xyzw(attitude())
    q = struct.pack("<4f", w, x, y, z)
    attitude_format = "vehicle_attitude:uint64_t timestamp;float[4] q;"

    # Two estimators; the second flies from 1.5 s.
    local = "uint64_t timestamp;float x;float y;float z;double ref_lat;double ref_lon;float ref_alt;bool xy_valid;bool z_valid;" \
        "bool xy_global;bool z_global;"
    samples = []
    for t in times():
        for index in range(2):
            off = 0.0 if index == int(t > 1.45) else 40.0
            north, east, down = ned(t)
            samples.append((us(t), index, struct.pack("<Q3f2df4B", us(t), north + off, east, down, *ORIGIN, 1, 1, 1, 1)))
            samples.append((us(t), 2 + index, struct.pack("<Q", us(t)) + q))
    samples += [(us(t) - 10, 4, struct.pack("<QB", us(t) - 10, primary)) for t, primary in ((0.0, 0), (1.5, 1))]
    ulog("estimators.ulg", [f"estimator_local_position:{local}", "estimator_attitude:uint64_t timestamp;float[4] q;",
                            "estimator_selector_status:uint64_t timestamp;uint8_t primary_instance;"],
         [("estimator_local_position", 0), ("estimator_local_position", 1), ("estimator_attitude", 0), ("estimator_attitude", 1),
          ("estimator_selector_status", 0)], samples)

    # Two receivers: the first never has a fix, the second has none for its first three samples.
    samples = [(us(t), 2, struct.pack("<Q", us(t)) + q) for t in times()]
    for i, t in enumerate(times()):
        for index in range(2):
            lat, lon, height = at(t, 0.0 if index else 40.0)
            fix_type = 3 if index and i >= 3 else 1
            samples.append((us(t), index, struct.pack("<Q4iB", us(t), round(lat * 1e7), round(lon * 1e7), round(height * 1e3),
                                                      round(height * 1e3), fix_type)))
    ulog("gps_instances.ulg", ["sensor_gps:uint64_t timestamp;int32_t lat;int32_t lon;int32_t alt;int32_t alt_ellipsoid;uint8_t fix_type;",
                               attitude_format], [("sensor_gps", 0), ("sensor_gps", 1), ("vehicle_attitude", 0)], samples)

    # Positions of a filter that is not global, and without GNSS from 2 s.
    samples = [(us(t), 1, struct.pack("<Q", us(t)) + q) for t in times()]
    for t in times():
        lat, lon, height = at(t, 0.0)
        samples.append((us(t), 0, struct.pack("<Q2dfB", us(t), lat, lon, height, int(t > 1.95))))
    ulog("dead_reckoning.ulg", ["vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;bool dead_reckoning;",
                                attitude_format], [("vehicle_global_position", 0), ("vehicle_attitude", 0)], samples)

    # Positions whose clock stands still.
    samples = [(us(t), 0, struct.pack("<Q2df", us(0), *at(t, 0.0))) for t in times()]
    samples += [(us(t), 1, struct.pack("<Q", us(t)) + q) for t in times()]
    ulog("equal_times.ulg", ["vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;", attitude_format],
         [("vehicle_global_position", 0), ("vehicle_attitude", 0)], samples)


if __name__ == "__main__":
    OUT.mkdir(exist_ok=True, parents=True)
    bags()
    ardupilot()
    px4()
    for path in sorted(OUT.iterdir()):
        assert path.stat().st_size < 20_000, path
        print(path.stat().st_size, path.name)
