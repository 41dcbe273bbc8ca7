; Everything is explored. Three rovers wait in a room behind m1; two carriers with two places each shall fetch them and
; end at their homes.

(define (problem n-return_home)
  (:domain marsupial)

  (:objects
    carrier_type - robot_type
    rover_type - robot_type
    carrier1 - carrier
    carrier2 - carrier
    rover1 - rover
    rover2 - rover
    rover3 - rover
    p1 - start
    p2 - start
    q1 - start
    q2 - start
    q3 - start
    m1 - meeting
    home1 - home
    home2 - home
  )

  (:init
    ; Where everybody is
    (at carrier1 p1)
    (at carrier2 p2)
    (at rover1 q1)
    (at rover2 q2)
    (at rover3 q3)
    (= (num_docked carrier1) 0)
    (= (num_docked carrier2) 0)
    ; What everybody can do
    (role_carrier carrier_type)
    (role_rover rover_type)
    (is_a carrier1 carrier_type)
    (= (capacity carrier1) 2)
    (is_a carrier2 carrier_type)
    (= (capacity carrier2) 2)
    (is_a rover1 rover_type)
    (= (dock_time rover1) 10.000)
    (= (undock_time rover1) 5.000)
    (can_stand rover1 m1)
    (is_a rover2 rover_type)
    (= (dock_time rover2) 10.000)
    (= (undock_time rover2) 5.000)
    (can_stand rover2 m1)
    (is_a rover3 rover_type)
    (= (dock_time rover3) 10.000)
    (= (undock_time rover3) 5.000)
    (can_stand rover3 m1)
    ; How long drives take
    (path carrier_type p1 m1)
    (= (path_cost carrier_type p1 m1) 10.000)
    (path carrier_type p1 home1)
    (= (path_cost carrier_type p1 home1) 0.001)
    (path carrier_type p1 home2)
    (= (path_cost carrier_type p1 home2) 2.000)
    (path carrier_type p2 m1)
    (= (path_cost carrier_type p2 m1) 6.000)
    (path carrier_type p2 home1)
    (= (path_cost carrier_type p2 home1) 4.000)
    (path carrier_type p2 home2)
    (= (path_cost carrier_type p2 home2) 2.000)
    (path carrier_type m1 home1)
    (= (path_cost carrier_type m1 home1) 10.000)
    (path carrier_type m1 home2)
    (= (path_cost carrier_type m1 home2) 8.000)
    (path carrier_type home1 m1)
    (= (path_cost carrier_type home1 m1) 10.000)
    (path carrier_type home1 home2)
    (= (path_cost carrier_type home1 home2) 2.000)
    (path carrier_type home2 m1)
    (= (path_cost carrier_type home2 m1) 8.000)
    (path carrier_type home2 home1)
    (= (path_cost carrier_type home2 home1) 2.000)
    (path rover_type q1 m1)
    (= (path_cost rover_type q1 m1) 2.000)
    (path rover_type q2 m1)
    (= (path_cost rover_type q2 m1) 4.000)
    (path rover_type q3 m1)
    (= (path_cost rover_type q3 m1) 6.000)
    ; Records, read by no action
    (return_home)
    (home_of carrier1 home1)
    (home_of carrier2 home2)
    (= (travel carrier_type p1 p1) 0.000)
    (= (travel carrier_type p1 p2) 4.000)
    (= (travel carrier_type p1 home1) 0.000)
    (= (travel carrier_type p2 p1) 4.000)
    (= (travel carrier_type p2 p2) 0.000)
    (= (travel carrier_type m1 p1) 10.000)
    (= (travel carrier_type m1 p2) 6.000)
    (= (travel carrier_type m1 m1) 0.000)
    (= (travel carrier_type home1 p1) 0.000)
    (= (travel carrier_type home1 p2) 4.000)
    (= (travel carrier_type home1 home1) 0.000)
    (= (travel carrier_type home2 p1) 2.000)
    (= (travel carrier_type home2 p2) 2.000)
    (= (travel carrier_type home2 home2) 0.000)
    (= (travel rover_type q1 q1) 0.000)
    (= (travel rover_type q1 q2) 2.000)
    (= (travel rover_type q1 q3) 4.000)
    (= (travel rover_type q2 q1) 2.000)
    (= (travel rover_type q2 q2) 0.000)
    (= (travel rover_type q2 q3) 2.000)
    (= (travel rover_type q3 q1) 4.000)
    (= (travel rover_type q3 q2) 2.000)
    (= (travel rover_type q3 q3) 0.000)
    (= (travel rover_type m1 q1) 2.000)
    (= (travel rover_type m1 q2) 4.000)
    (= (travel rover_type m1 q3) 6.000)
    (= (travel rover_type m1 m1) 0.000)
  )

  (:goal (and
    (aboard rover1)
    (aboard rover2)
    (aboard rover3)
    (at carrier1 home1)
    (at carrier2 home2)
  ))

  (:metric minimize (total-time)))
