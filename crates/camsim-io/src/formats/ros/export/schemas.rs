//! Definitions of the messages, as the public interfaces of ROS 2 have them, without comments.

/// Begins the definition of a type that another one needs.
const SEPARATOR: &str = "================================================================================\n";

const TIME: &str = "int32 sec\nuint32 nanosec\n";
const HEADER: &str = "builtin_interfaces/Time stamp\nstring frame_id\n";
const VECTOR3: &str = "float64 x\nfloat64 y\nfloat64 z\n";
const QUATERNION: &str = "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n";
const POSE: &str = "Point position\nQuaternion orientation\n";
const TRANSFORM: &str = "Vector3 translation\nQuaternion rotation\n";
const STAMPED: &str = "std_msgs/Header header\nstring child_frame_id\nTransform transform\n";
const ROI: &str = "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n";
const STATUS: &str = "int8 STATUS_NO_FIX=-1\nint8 STATUS_FIX=0\nint8 STATUS_SBAS_FIX=1\nint8 STATUS_GBAS_FIX=2\n\
                      int8 status\nuint16 SERVICE_GPS=1\nuint16 SERVICE_GLONASS=2\nuint16 SERVICE_COMPASS=4\n\
                      uint16 SERVICE_GALILEO=8\nuint16 service\n";

const COMPRESSED_IMAGE: &str = "std_msgs/Header header\nstring format\nuint8[] data\n";
const IMAGE: &str = "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n\
                     uint32 step\nuint8[] data\n";
const CAMERA_INFO: &str = "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n\
                           float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n\
                           RegionOfInterest roi\n";
const IMU: &str = "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
                   geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
                   geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n";
const FIX: &str = "std_msgs/Header header\nNavSatStatus status\nfloat64 latitude\nfloat64 longitude\nfloat64 altitude\n\
                   float64[9] position_covariance\nuint8 COVARIANCE_TYPE_UNKNOWN=0\n\
                   uint8 COVARIANCE_TYPE_APPROXIMATED=1\nuint8 COVARIANCE_TYPE_DIAGONAL_KNOWN=2\n\
                   uint8 COVARIANCE_TYPE_KNOWN=3\nuint8 position_covariance_type\n";
const TF: &str = "geometry_msgs/TransformStamped[] transforms\n";
const POSE_STAMPED: &str = "std_msgs/Header header\nPose pose\n";

/// A type by its name.
type Definition = (&'static str, &'static str);

const STAMP: [Definition; 2] = [("std_msgs/Header", HEADER), ("builtin_interfaces/Time", TIME)];

/// Definition of a type, followed by those of the types that it needs.
pub(super) fn text(kind: &str) -> String {
    let (own, others): (&str, &[Definition]) = match kind {
        "sensor_msgs/msg/CompressedImage" => (COMPRESSED_IMAGE, &[]),
        "sensor_msgs/msg/Image" => (IMAGE, &[]),
        "sensor_msgs/msg/CameraInfo" => (CAMERA_INFO, &[("sensor_msgs/RegionOfInterest", ROI)]),
        "sensor_msgs/msg/Imu" => {
            (IMU, &[("geometry_msgs/Quaternion", QUATERNION), ("geometry_msgs/Vector3", VECTOR3)])
        }
        "sensor_msgs/msg/NavSatFix" => (FIX, &[("sensor_msgs/NavSatStatus", STATUS)]),
        "tf2_msgs/msg/TFMessage" => (
            TF,
            &[
                ("geometry_msgs/TransformStamped", STAMPED),
                ("geometry_msgs/Transform", TRANSFORM),
                ("geometry_msgs/Vector3", VECTOR3),
                ("geometry_msgs/Quaternion", QUATERNION),
            ],
        ),
        _ => (
            POSE_STAMPED,
            &[
                ("geometry_msgs/Pose", POSE),
                ("geometry_msgs/Point", VECTOR3),
                ("geometry_msgs/Quaternion", QUATERNION),
            ],
        ),
    };
    let mut text = own.to_owned();
    for (name, definition) in others.iter().chain(&STAMP) {
        text += &format!("{SEPARATOR}MSG: {name}\n{definition}");
    }
    text
}
