; The scene of the paper's Fig. 1. A carrier (robot0) with a rover aboard (robot1) can explore t1, 8 s to the left, and
; t3, 15 s to the right, itself; t2 lies in an area for rovers only, behind the meeting point m1, 5 s to the right.
; Rovers are half as fast as carriers.

(define (problem deploy)
  (:domain marsupial)

  (:objects
    carrier_type - robot_type
    rover_type - robot_type
    robot0 - carrier
    robot1 - rover
    p - start
    t1 - target
    t2 - target
    t3 - target
    m1 - meeting
  )

  (:init
    ; Where everybody is
    (at robot0 p)
    (on robot1 robot0)
    (aboard robot1)
    (= (num_docked robot0) 1)
    ; What everybody can do
    (role_carrier carrier_type)
    (role_rover rover_type)
    (is_a robot0 carrier_type)
    (= (capacity robot0) 1)
    (can_explore robot0 t1)
    (can_explore robot0 t3)
    (is_a robot1 rover_type)
    (= (dock_time robot1) 10.000)
    (= (undock_time robot1) 5.000)
    (can_explore robot1 t2)
    (can_stand robot1 m1)
    ; How long drives take
    (path carrier_type p t1)
    (= (path_cost carrier_type p t1) 8.000)
    (path carrier_type p t3)
    (= (path_cost carrier_type p t3) 15.000)
    (path carrier_type p m1)
    (= (path_cost carrier_type p m1) 5.000)
    (path carrier_type t1 t3)
    (= (path_cost carrier_type t1 t3) 23.000)
    (path carrier_type t1 m1)
    (= (path_cost carrier_type t1 m1) 13.000)
    (path carrier_type t3 t1)
    (= (path_cost carrier_type t3 t1) 23.000)
    (path carrier_type t3 m1)
    (= (path_cost carrier_type t3 m1) 10.000)
    (path carrier_type m1 t1)
    (= (path_cost carrier_type m1 t1) 13.000)
    (path carrier_type m1 t3)
    (= (path_cost carrier_type m1 t3) 10.000)
    (path rover_type t2 m1)
    (= (path_cost rover_type t2 m1) 8.000)
    (path rover_type m1 t2)
    (= (path_cost rover_type m1 t2) 8.000)
    ; Records, read by no action
    (= (reveal t1) 1.0)
    (= (reveal t2) 1.0)
    (= (reveal t3) 1.0)
    (= (travel carrier_type p p) 0.000)
    (= (travel carrier_type t1 p) 8.000)
    (= (travel carrier_type t1 t1) 0.000)
    (= (travel carrier_type t3 p) 15.000)
    (= (travel carrier_type t3 t3) 0.000)
    (= (travel carrier_type m1 p) 5.000)
    (= (travel carrier_type m1 m1) 0.000)
    (= (travel rover_type t2 t2) 0.000)
    (= (travel rover_type m1 m1) 0.000)
  )

  (:goal (and
    (explored t1)
    (explored t2)
    (explored t3)
  ))

  (:metric minimize (total-time)))
